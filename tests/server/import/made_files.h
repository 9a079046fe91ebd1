// tests/server/import/made_files.h - small DICOM and NIfTI files with every field in the test's hand.
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>
#include <zlib.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "core/volume/grid.h"
#include "server/import/import.h"

namespace spinaltap::importer {

/// A folder of its own for one test, removed at the end.
class Scratch {
 public:
  Scratch() {
    std::string name = (std::filesystem::temp_directory_path() / "spinaltap-import-test-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch() { std::filesystem::remove_all(path_); }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    const std::filesystem::path file = path_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << bytes;
    return file;
  }

 private:
  std::filesystem::path path_;
};

inline std::string readBytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

template <class T>
std::string littleEndian(T value) {
  std::string out(sizeof(T), '\0');
  std::memcpy(out.data(), &value, sizeof(T));
  return out;
}

inline std::string words(const std::vector<int>& values) {
  std::string out;
  for (const int v : values) out += littleEndian(static_cast<std::uint16_t>(v));
  return out;
}

using DicomTag = std::pair<int, int>;
struct DicomValue {
  std::string vr, bytes;
};

/// Elements in tag order; tests change, add and erase them.
using DicomElements = std::map<DicomTag, DicomValue>;

inline std::string explicitElements(const DicomElements& elements) {
  std::string out;
  for (const auto& [tag, value] : elements) {
    std::string bytes = value.bytes;
    if (bytes.size() % 2 != 0) bytes.push_back(value.vr == "UI" || value.vr == "OW" ? '\0' : ' ');
    out += words({tag.first, tag.second}) + value.vr;
    const bool long_form = value.vr == "OW" || value.vr == "OB" || value.vr == "SQ" || value.vr == "UN";
    out += long_form ? words({0}) + littleEndian(static_cast<std::uint32_t>(bytes.size()))
                     : words({static_cast<int>(bytes.size())});
    out += bytes;
  }
  return out;
}

inline std::string item(const DicomElements& elements) {
  const std::string bytes = explicitElements(elements);
  return words({0xfffe, 0xe000}) + littleEndian(static_cast<std::uint32_t>(bytes.size())) + bytes;
}

inline std::string part10(const DicomElements& elements, const std::string& syntax = "1.2.840.10008.1.2.1") {
  const std::string meta = explicitElements({{{2, 0x10}, {"UI", syntax}}});
  const std::string size = littleEndian(static_cast<std::uint32_t>(meta.size()));
  return std::string(128, '\0') + "DICM" + explicitElements({{{2, 0}, {"UL", size}}}) + meta +
         explicitElements(elements);
}

constexpr int kRows = 6, kColumns = 5;

/// HU of the made series: every voxel different, so that any swap or flip shows.
inline int madeHu(int i, int j, int k) { return -1000 + i + 10 * j + 100 * k; }

/// Slice k of an axial series: 5 columns x 6 rows, 0.5 mm columns apart, 0.75 mm rows apart, 2 mm slices.
inline DicomElements madeSlice(int k) {
  std::string cells;
  for (int j = 0; j < kRows; ++j) {
    for (int i = 0; i < kColumns; ++i) cells += words({madeHu(i, j, k) + 1024});
  }
  return {
      {{0x0008, 0x0008}, {"CS", "ORIGINAL\\PRIMARY\\AXIAL"}},
      {{0x0008, 0x0016}, {"UI", "1.2.840.10008.5.1.4.1.1.2"}},
      {{0x0008, 0x0018}, {"UI", "1.2.3.4." + std::to_string(100 + k)}},
      {{0x0008, 0x0060}, {"CS", "CT"}},
      {{0x0010, 0x0010}, {"PN", "SECRET^PERSON"}},
      {{0x0010, 0x0020}, {"LO", "SECRETID"}},
      {{0x0018, 0x0050}, {"DS", "2"}},
      {{0x0020, 0x000e}, {"UI", "1.2.3.4.5"}},
      {{0x0020, 0x0032}, {"DS", "-10\\20\\" + std::to_string(30 + 2 * k)}},
      {{0x0020, 0x0037}, {"DS", "1\\0\\0\\0\\1\\0"}},
      {{0x0020, 0x0052}, {"UI", "1.2.3.4.6"}},
      {{0x0028, 0x0002}, {"US", words({1})}},
      {{0x0028, 0x0004}, {"CS", "MONOCHROME2"}},
      {{0x0028, 0x0010}, {"US", words({kRows})}},
      {{0x0028, 0x0011}, {"US", words({kColumns})}},
      {{0x0028, 0x0030}, {"DS", "0.75\\0.5"}},
      {{0x0028, 0x0100}, {"US", words({16})}},
      {{0x0028, 0x0101}, {"US", words({12})}},
      {{0x0028, 0x0102}, {"US", words({11})}},
      {{0x0028, 0x0103}, {"US", words({0})}},
      {{0x0028, 0x1052}, {"DS", "-1024"}},
      {{0x0028, 0x1053}, {"DS", "1"}},
      {{0x7fe0, 0x0010}, {"OW", cells}},
  };
}

/// The name of slice k: not in the order of the slices.
inline std::string sliceName(int k) { return std::to_string((k * 7 + 3) % 11) + ".dcm"; }

/// Writes `count` slices, each after `change` has had its way.
template <class Change>
void writeSeries(const Scratch& scratch, int count, const Change& change) {
  for (int k = 0; k < count; ++k) {
    DicomElements slice = madeSlice(k);
    change(k, slice);
    scratch.write(sliceName(k), part10(slice));
  }
}

inline Result<ImportedVolume> importFrom(const std::filesystem::path& from) {
  ImportRequest request;
  request.from = from;
  return importVolume(request);
}

/// Every error is one line without paths or what the header says of the patient.
inline void expectClean(const Error& error) {
  EXPECT_FALSE(error.message.empty());
  EXPECT_LE(error.message.size(), 600u);
  for (const char c : error.message) EXPECT_TRUE(c >= 0x20 && c < 0x7f) << "byte " << static_cast<int>(c);
  EXPECT_EQ(error.message.find(std::filesystem::temp_directory_path().string()), std::string::npos);
  EXPECT_EQ(error.message.find("SECRET"), std::string::npos);
  EXPECT_EQ(error.message.find("a sanitizer"), std::string::npos) << error.message;
}

/// One-line refusal that holds `word`.
inline void expectRefusal(const Result<ImportedVolume>& result, const std::string& word) {
  ASSERT_FALSE(result.has_value()) << "expected a refusal with \"" << word << "\"";
  expectClean(result.error());
  EXPECT_NE(result.error().message.find(word), std::string::npos) << result.error().message;
}

inline std::string gzipped(const std::string& bytes) {
  z_stream z{};
  EXPECT_EQ(deflateInit2(&z, Z_BEST_SPEED, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::string out(deflateBound(&z, bytes.size()) + 64, '\0');
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  z.avail_in = static_cast<uInt>(bytes.size());
  z.next_out = reinterpret_cast<Bytef*>(out.data());
  z.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(deflate(&z, Z_FINISH), Z_STREAM_END);
  out.resize(out.size() - z.avail_out);
  deflateEnd(&z);
  return out;
}

/// A NIfTI-1 file of 4 x 3 x 2 voxels unless changed; sform in RAS.
struct MadeNifti {
  std::array<int, 3> dims{4, 3, 2};
  int fourth = 1, dimensions = 3;
  int datatype = 4, bits = 16;
  float slope = 0, intercept = 0;
  int sform = 1, qform = 0, units = 2;
  std::array<float, 12> srow{-2, 0, 0, 10, 0, 3, 0, 20, 0, 0, 4, 30};
  std::array<float, 3> quatern{0, 0, 0}, offset{0, 0, 0};
  std::array<float, 4> pixdim{1, 2, 3, 4};
  float vox_offset = 352;
  std::string magic = std::string("n+1\0", 4);
  std::string voxels;

  [[nodiscard]] std::string bytes() const {
    std::string h(352, '\0');
    const auto put = [&](std::size_t at, const auto& value) { std::memcpy(h.data() + at, &value, sizeof value); };
    put(0, std::int32_t{348});
    put(40, static_cast<std::int16_t>(dimensions));
    for (std::size_t d = 0; d < 3; ++d) put(42 + 2 * d, static_cast<std::int16_t>(dims[d]));
    put(48, static_cast<std::int16_t>(fourth));
    put(70, static_cast<std::int16_t>(datatype));
    put(72, static_cast<std::int16_t>(bits));
    put(76, pixdim);
    put(108, vox_offset);
    put(112, slope);
    put(116, intercept);
    h[123] = static_cast<char>(units);
    put(252, static_cast<std::int16_t>(qform));
    put(254, static_cast<std::int16_t>(sform));
    put(256, quatern);
    put(268, offset);
    put(280, srow);
    std::memcpy(h.data() + 344, magic.data(), 4);
    return h + voxels;
  }
  /// value(i, j, k) as T, i fastest.
  template <class T, class Value>
  void fill(const Value& value) {
    voxels.clear();
    for (int k = 0; k < dims[2]; ++k) {
      for (int j = 0; j < dims[1]; ++j) {
        for (int i = 0; i < dims[0]; ++i) voxels += littleEndian(static_cast<T>(value(i, j, k)));
      }
    }
  }
};

}  // namespace spinaltap::importer
