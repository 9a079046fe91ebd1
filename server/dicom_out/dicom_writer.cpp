#include "server/dicom_out/dicom_writer.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdio>
#include <string_view>

#include "core/base/hash.h"

namespace spinaltap::dicom_out {
namespace {

constexpr std::string_view kCtImageStorage = "1.2.840.10008.5.1.4.1.1.2";
constexpr std::string_view kExplicitLittleEndian = "1.2.840.10008.1.2.1";
constexpr int kIntercept = -1024, kHighestStored = 4095;

enum Role : std::uint64_t { kStudy = 1, kSeries, kFrameOfReference, kInstance, kImplementation };

using Bytes = std::vector<std::uint8_t>;

/// Appends data elements in explicit VR little endian; the caller keeps their tags ascending.
class Elements {
 public:
  void text(std::uint16_t group, std::uint16_t element, std::string_view vr, std::string_view value) {
    Bytes padded(value.begin(), value.end());
    // UIDs are padded by a zero byte, all other text by a space (PS3.5 6.2).
    if (padded.size() % 2 != 0) padded.push_back(vr == "UI" ? 0 : ' ');
    put(group, element, vr, padded);
  }
  void number(std::uint16_t group, std::uint16_t element, int value) {
    assert(value >= 0 && value <= 0xffff);
    put(group, element, "US", {static_cast<std::uint8_t>(value & 0xff), static_cast<std::uint8_t>(value >> 8)});
  }
  void put(std::uint16_t group, std::uint16_t element, std::string_view vr, const Bytes& value) {
    assert(value.size() % 2 == 0);
    u16(group);
    u16(element);
    out_.insert(out_.end(), vr.begin(), vr.end());
    if (vr == "OB" || vr == "OW") {
      u16(0);
      u32(static_cast<std::uint32_t>(value.size()));
    } else {
      u16(static_cast<std::uint16_t>(value.size()));
    }
    out_.insert(out_.end(), value.begin(), value.end());
  }
  [[nodiscard]] const Bytes& bytes() const { return out_; }

 private:
  void u16(std::uint16_t v) {
    out_.push_back(static_cast<std::uint8_t>(v & 0xff));
    out_.push_back(static_cast<std::uint8_t>(v >> 8));
  }
  void u32(std::uint32_t v) {
    u16(static_cast<std::uint16_t>(v & 0xffff));
    u16(static_cast<std::uint16_t>(v >> 16));
  }

  Bytes out_;
};

std::string joined(const Vec3& v) { return decimalString(v.x) + '\\' + decimalString(v.y) + '\\' + decimalString(v.z); }

void metaInformation(Bytes& file, const std::string& instance) {
  Elements meta;
  meta.put(0x0002, 0x0001, "OB", {0, 1});
  meta.text(0x0002, 0x0002, "UI", kCtImageStorage);
  meta.text(0x0002, 0x0003, "UI", instance);
  meta.text(0x0002, 0x0010, "UI", kExplicitLittleEndian);
  meta.text(0x0002, 0x0012, "UI", uidFrom(0, kImplementation, 0));
  meta.text(0x0002, 0x0013, "SH", "SPINALTAP");
  const auto length = static_cast<std::uint32_t>(meta.bytes().size());
  Elements head;
  head.put(0x0002, 0x0000, "UL",
           {static_cast<std::uint8_t>(length & 0xff), static_cast<std::uint8_t>((length >> 8) & 0xff),
            static_cast<std::uint8_t>((length >> 16) & 0xff), static_cast<std::uint8_t>(length >> 24)});
  file.assign(128, 0);
  for (const char c : {'D', 'I', 'C', 'M'}) file.push_back(static_cast<std::uint8_t>(c));
  file.insert(file.end(), head.bytes().begin(), head.bytes().end());
  file.insert(file.end(), meta.bytes().begin(), meta.bytes().end());
}

/// Groups 0008 to 0018: what it is and of whom. Elements that must be present but may be empty (type 2) are empty.
void identification(Elements& e, const std::string& instance, const SeriesIdentity& identity, double spacing_mm) {
  e.text(0x0008, 0x0005, "CS", "ISO_IR 192");
  e.text(0x0008, 0x0008, "CS", "ORIGINAL\\PRIMARY\\AXIAL");
  e.text(0x0008, 0x0016, "UI", kCtImageStorage);
  e.text(0x0008, 0x0018, "UI", instance);
  e.text(0x0008, 0x0020, "DA", "");
  e.text(0x0008, 0x0030, "TM", "");
  e.text(0x0008, 0x0050, "SH", "");
  e.text(0x0008, 0x0060, "CS", "CT");
  e.text(0x0008, 0x0070, "LO", "SpinalTap");
  e.text(0x0008, 0x0090, "PN", "");
  e.text(0x0008, 0x103e, "LO", identity.description);
  e.text(0x0010, 0x0010, "PN", identity.patient_name);
  e.text(0x0010, 0x0020, "LO", identity.patient_id);
  e.text(0x0010, 0x0030, "DA", "");
  e.text(0x0010, 0x0040, "CS", "");
  e.text(0x0018, 0x0050, "DS", decimalString(identity.slice_thickness_mm));
  e.text(0x0018, 0x0060, "DS", "");
  e.text(0x0018, 0x0088, "DS", decimalString(spacing_mm));
  e.text(0x0018, 0x5100, "CS", "HFS");
}

/// Group 0020: which slice, and where in the patient.
void geometry(Elements& e, const volume::Grid& grid, int k, const SeriesIdentity& identity) {
  e.text(0x0020, 0x000d, "UI", uidFrom(identity.uid_seed, kStudy, 0));
  e.text(0x0020, 0x000e, "UI", uidFrom(identity.uid_seed, kSeries, 0));
  e.text(0x0020, 0x0010, "SH", "1");
  e.text(0x0020, 0x0011, "IS", "1");
  e.text(0x0020, 0x0012, "IS", "1");
  e.text(0x0020, 0x0013, "IS", std::to_string(k + 1));
  const Vec3 position = grid.toPatient({0, 0, static_cast<double>(k)});
  e.text(0x0020, 0x0032, "DS", joined(position));
  e.text(0x0020, 0x0037, "DS", joined(grid.direction.col_x) + '\\' + joined(grid.direction.col_y));
  e.text(0x0020, 0x0052, "UI", uidFrom(identity.uid_seed, kFrameOfReference, 0));
  e.text(0x0020, 0x1040, "LO", "");
  e.text(0x0020, 0x1041, "DS", decimalString(dot(position, grid.direction.col_z)));
}

/// Group 0028: how the pixels are stored and shown.
void pixelDescription(Elements& e, const volume::Grid& grid) {
  e.number(0x0028, 0x0002, 1);
  e.text(0x0028, 0x0004, "CS", "MONOCHROME2");
  e.number(0x0028, 0x0010, grid.dims[1]);
  e.number(0x0028, 0x0011, grid.dims[0]);
  e.text(0x0028, 0x0030, "DS", decimalString(grid.spacing_mm.y) + '\\' + decimalString(grid.spacing_mm.x));
  e.number(0x0028, 0x0100, 16);
  e.number(0x0028, 0x0101, 12);
  e.number(0x0028, 0x0102, 11);
  e.number(0x0028, 0x0103, 0);
  e.text(0x0028, 0x0301, "CS", "NO");
  e.text(0x0028, 0x1050, "DS", "400");
  e.text(0x0028, 0x1051, "DS", "1800");
  e.text(0x0028, 0x1052, "DS", std::to_string(kIntercept));
  e.text(0x0028, 0x1053, "DS", "1");
  e.text(0x0028, 0x1054, "LO", "HU");
}

Bytes pixels(const volume::CtVolume& ct, int k) {
  const std::size_t count = static_cast<std::size_t>(ct.grid.dims[0]) * static_cast<std::size_t>(ct.grid.dims[1]);
  const std::size_t first = ct.grid.index(0, 0, k);
  Bytes out;
  out.reserve(2 * count);
  for (std::size_t n = 0; n < count; ++n) {
    const int value = std::clamp(ct.hu[first + n] - kIntercept, 0, kHighestStored);
    out.push_back(static_cast<std::uint8_t>(value & 0xff));
    out.push_back(static_cast<std::uint8_t>(value >> 8));
  }
  return out;
}

}  // namespace

std::string uidFrom(std::uint64_t seed, std::uint64_t role, std::uint64_t index) {
  const std::uint64_t hash = combine(combine(seed, role), index);
  // Version 8 (our own making) and the variant of RFC 9562, so that the number is a UUID.
  const std::uint64_t high = (mix64(hash) & 0xffffffffffff0fffULL) | 0x8000ULL;
  const std::uint64_t low = (mix64(hash + 1) & 0x3fffffffffffffffULL) | 0x8000000000000000ULL;
  std::array<std::uint64_t, 4> limbs{high >> 32, high & 0xffffffffULL, low >> 32, low & 0xffffffffULL};
  std::string digits;
  while (std::any_of(limbs.begin(), limbs.end(), [](std::uint64_t limb) { return limb != 0; })) {
    std::uint64_t rest = 0;
    for (std::uint64_t& limb : limbs) {
      const std::uint64_t part = (rest << 32) | limb;
      limb = part / 10;
      rest = part % 10;
    }
    digits.push_back(static_cast<char>('0' + rest));
  }
  std::reverse(digits.begin(), digits.end());
  return "2.25." + digits;
}

std::string decimalString(double value) {
  std::array<char, 40> text{};
  for (int precision = 12; precision >= 9; --precision) {
    const int length = std::snprintf(text.data(), text.size(), "%.*g", precision, value + 0.0);
    if (length <= 16) return {text.data(), static_cast<std::size_t>(length)};
  }
  return text.data();
}

std::vector<std::uint8_t> sliceFile(const volume::CtVolume& ct, int k, const SeriesIdentity& identity) {
  assert(k >= 0 && k < ct.grid.dims[2]);
  const std::string instance = uidFrom(identity.uid_seed, kInstance, static_cast<std::uint64_t>(k));
  Elements e;
  identification(e, instance, identity, ct.grid.spacing_mm.z);
  geometry(e, ct.grid, k, identity);
  pixelDescription(e, ct.grid);
  e.put(0x7fe0, 0x0010, "OW", pixels(ct, k));
  Bytes file;
  metaInformation(file, instance);
  file.insert(file.end(), e.bytes().begin(), e.bytes().end());
  return file;
}

}  // namespace spinaltap::dicom_out
