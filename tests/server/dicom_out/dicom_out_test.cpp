#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "part10_reader.h"
#include "server/dicom_out/dicom_writer.h"
#include "server/dicom_out/phantom_series.h"

namespace spinaltap::dicom_out {
namespace {

namespace fs = std::filesystem;
using test::Part10;
using test::readPart10;

/// A folder that goes away with the test.
class Scratch {
 public:
  Scratch() {
    std::string name = (fs::temp_directory_path() / "dicom_out_XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  [[nodiscard]] fs::path operator/(const std::string& name) const { return path_ / name; }

 private:
  fs::path path_;
};

std::vector<std::uint8_t> bytesOf(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::vector<std::string> namesIn(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

PhantomSeriesOptions small(std::uint64_t seed = 1) {
  PhantomSeriesOptions options;
  options.phantom.seed = seed;
  options.ct = phantom::CtOptions::coarser(12);
  return options;
}

/// An oblique grid of few voxels, with values at both ends of the range and beyond.
volume::CtVolume oblique() {
  volume::CtVolume ct;
  ct.grid.dims = {5, 3, 4};
  ct.grid.spacing_mm = {0.352, 0.7, 1.25};
  ct.grid.origin_patient = {-123.456789012, 78.125, -840.0000003};
  ct.grid.direction = {{0.8, 0.6, 0}, {-0.6, 0.8, 0}, {0, 0, 1}};
  for (int n = 0; n < 60; ++n) ct.hu.push_back(static_cast<std::int16_t>(n * 100 - 1100));
  return ct;
}

TEST(DicomWriter, WritesElementsThatAStrictReaderAccepts) {
  const auto ct = oblique();
  for (int k = 0; k < 4; ++k) {
    const Part10 file = readPart10(sliceFile(ct, k, {}));
    ASSERT_EQ(file.complaint, "") << k;
    EXPECT_EQ(file.text(0x00020010), "1.2.840.10008.1.2.1");
    EXPECT_EQ(file.text(0x00080016), "1.2.840.10008.5.1.4.1.1.2");
    EXPECT_EQ(file.text(0x00020003), file.text(0x00080018));
    EXPECT_EQ(file.text(0x00080060), "CT");
    EXPECT_EQ(file.text(0x00080008), "ORIGINAL\\PRIMARY\\AXIAL");
    EXPECT_EQ(file.text(0x00280301), "NO");
    EXPECT_EQ(file.text(0x00200013), std::to_string(k + 1));
  }
}

TEST(DicomWriter, KeepsTheGeometryOfAnObliqueGrid) {
  const auto ct = oblique();
  for (int k = 0; k < 4; ++k) {
    const Part10 file = readPart10(sliceFile(ct, k, {}));
    EXPECT_EQ(file.number(0x00280010), 3) << "rows";
    EXPECT_EQ(file.number(0x00280011), 5) << "columns";
    EXPECT_EQ(file.decimals(0x00280030), (std::vector<double>{0.7, 0.352})) << "between rows, then columns";
    EXPECT_EQ(file.decimals(0x00200037), (std::vector<double>{0.8, 0.6, 0, -0.6, 0.8, 0}));
    const Vec3 truth = ct.grid.toPatient({0, 0, static_cast<double>(k)});
    const auto position = file.decimals(0x00200032);
    // Sixteen characters hold nine digits or more: a micrometre at a metre's distance.
    EXPECT_NEAR(position.at(0), truth.x, 1e-6);
    EXPECT_NEAR(position.at(1), truth.y, 1e-6);
    EXPECT_NEAR(position.at(2), truth.z, 1e-6);
  }
}

TEST(DicomWriter, StoresHuInTwelveBitsAndClampsWhatDoesNotFit) {
  const auto ct = oblique();
  const Part10 file = readPart10(sliceFile(ct, 2, {}));
  const std::string& pixels = file.elements.at(0x7fe00010).value;
  ASSERT_EQ(pixels.size(), 2u * 15);
  EXPECT_EQ(file.number(0x00280101), 12);
  EXPECT_EQ(file.text(0x00281052), "-1024");
  const auto first = readPart10(sliceFile(ct, 0, {})).elements.at(0x7fe00010).value;
  const auto hu = [](const std::string& raw, std::size_t n) {
    return (static_cast<unsigned char>(raw[2 * n]) | static_cast<unsigned char>(raw[2 * n + 1]) << 8) - 1024;
  };
  EXPECT_EQ(hu(first, 0), -1024) << "-1100 is clamped";
  EXPECT_EQ(hu(first, 1), -1000);
  for (std::size_t n = 0; n < 15; ++n) EXPECT_EQ(hu(pixels, n), std::min(ct.hu[30 + n] + 0, 3071));
}

TEST(DicomWriter, DecimalStringsFitSixteenCharactersAndReadBack) {
  for (const double value :
       {0.0, -0.0, 0.352, -123.456789012345, 1e-17, -1.23456789012e-17, 12345678.9, -867.5259467871141}) {
    const std::string text = decimalString(value);
    EXPECT_LE(text.size(), 16u) << text;
    EXPECT_NEAR(std::stod(text), value, 1e-9 * std::max(1.0, std::abs(value))) << text;
    EXPECT_NE(text, "-0");
  }
}

TEST(DicomWriter, UidsAreValidAndDifferInEveryRole) {
  std::set<std::string> seen;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    for (std::uint64_t role = 1; role <= 5; ++role) {
      for (std::uint64_t index = 0; index < 20; ++index) {
        const std::string uid = uidFrom(seed, role, index);
        EXPECT_LE(uid.size(), 64u);
        EXPECT_EQ(uid.substr(0, 5), "2.25.");
        EXPECT_NE(uid[5], '0') << "no component starts with a zero";
        EXPECT_EQ(uid.find_first_not_of("0123456789."), std::string::npos);
        EXPECT_TRUE(seen.insert(uid).second) << uid;
      }
    }
  }
}

TEST(PhantomSeries, WritesEverySliceAndTheTruthAndNothingElse) {
  const Scratch scratch;
  const fs::path out = scratch / "new" / "series";
  double last = 0;
  const auto summary = writePhantomSeries(out, small(), [&](double part) {
    EXPECT_GE(part, last);
    last = part;
  });
  ASSERT_TRUE(summary) << summary.error().message;
  EXPECT_DOUBLE_EQ(last, 1.0);
  const auto names = namesIn(out);
  ASSERT_EQ(names.size(), static_cast<std::size_t>(summary->slices) + 1);
  EXPECT_EQ(names.front(), "slice-000.dcm");
  EXPECT_EQ(names.back(), "truth.json");
  EXPECT_GT(summary->bone_mm3, 40000);
  EXPECT_LT(summary->bone_mm3, 70000);
}

TEST(PhantomSeries, SlicesAreOneSeriesThatHoldsTheSampledVolume) {
  const Scratch scratch;
  const auto options = small(3);
  const auto summary = writePhantomSeries(scratch / "s", options).value();
  const auto ct = phantom::sampleCt(phantom::Phantom::make(options.phantom), options.ct).value();
  std::set<std::string> series, instances;
  for (int k = 0; k < summary.slices; ++k) {
    std::array<char, 32> name{};
    std::snprintf(name.data(), name.size(), "slice-%03d.dcm", k);
    const Part10 file = readPart10(bytesOf(scratch / "s" / name.data()));
    ASSERT_EQ(file.complaint, "");
    series.insert(file.text(0x0020000e));
    instances.insert(file.text(0x00080018));
    EXPECT_EQ(file.text(0x00100010), "Phantom^L3");
    EXPECT_EQ(file.text(0x00100020), "PHANTOM-3");
    EXPECT_NEAR(file.decimals(0x00200032).at(2), ct.grid.origin_patient.z + k * ct.grid.spacing_mm.z, 1e-6);
    const std::string& raw = file.elements.at(0x7fe00010).value;
    const std::size_t count = raw.size() / 2, first = ct.grid.index(0, 0, k);
    for (std::size_t n = 0; n < count; ++n) {
      const int stored = static_cast<unsigned char>(raw[2 * n]) | static_cast<unsigned char>(raw[2 * n + 1]) << 8;
      ASSERT_EQ(stored - 1024, ct.hu[first + n]) << "slice " << k << " pixel " << n;
    }
  }
  EXPECT_EQ(series.size(), 1u);
  EXPECT_EQ(instances.size(), static_cast<std::size_t>(summary.slices));
}

TEST(PhantomSeries, HasTheSameBytesForTheSameOptionsAndOtherUidsForOthers) {
  const Scratch scratch;
  ASSERT_TRUE(writePhantomSeries(scratch / "a", small()));
  ASSERT_TRUE(writePhantomSeries(scratch / "b", small()));
  for (const std::string& name : namesIn(scratch / "a")) {
    EXPECT_EQ(bytesOf(scratch / "a" / name), bytesOf(scratch / "b" / name)) << name;
  }
  auto weak = small();
  weak.phantom.osteoporotic = true;
  ASSERT_TRUE(writePhantomSeries(scratch / "c", weak));
  EXPECT_NE(readPart10(bytesOf(scratch / "a" / "slice-001.dcm")).text(0x00080018),
            readPart10(bytesOf(scratch / "c" / "slice-001.dcm")).text(0x00080018));
}

TEST(PhantomSeries, TheTruthRebuildsTheSamePhantom) {
  auto options = small(17);
  options.phantom.osteoporotic = true;
  const auto truth = nlohmann::json::parse(truthJson(options));
  EXPECT_EQ(truth.at("schema"), "spinaltap-phantom-truth-1");
  const auto rebuilt = phantom::Phantom::make({truth.at("seed"), truth.at("osteoporotic")});
  const auto point = [](const nlohmann::json& v) { return Vec3{v.at(0), v.at(1), v.at(2)}; };
  for (const auto* name : {"left", "right"}) {
    const auto& json = truth.at("pedicles").at(name);
    const auto& path = rebuilt.pedicle(std::string(name) == "left" ? phantom::Side::Left : phantom::Side::Right);
    // Numbers are printed so that they read back to the bit.
    EXPECT_EQ(point(json.at("entry_patient")), path.entry_patient);
    EXPECT_EQ(point(json.at("target_patient")), path.target_patient);
    EXPECT_EQ(json.at("width_mm").get<double>(), path.width_mm);
  }
  EXPECT_EQ(point(truth.at("seed_point_patient")), rebuilt.seedPoint());
  EXPECT_EQ(point(truth.at("frame").at("origin_patient")), rebuilt.frame().origin_patient);
  EXPECT_EQ(point(truth.at("grid").at("origin_patient")), phantom::ctGrid(rebuilt, options.ct).origin_patient);
}

TEST(PhantomSeries, RefusesAFolderThatHoldsSomethingAndLeavesItAlone) {
  const Scratch scratch;
  fs::create_directory(scratch / "s");
  std::ofstream(scratch / "s" / "mine.txt") << "keep";
  const auto refused = writePhantomSeries(scratch / "s", small());
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(namesIn(scratch / "s"), std::vector<std::string>{"mine.txt"});
}

TEST(PhantomSeries, SaysWhatFailedWithoutAnAbsolutePath) {
  const Scratch scratch;
  std::ofstream(scratch / "file") << "not a folder";
  const auto refused = writePhantomSeries(scratch / "file" / "below", small());
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Io);
  EXPECT_EQ(refused.error().message.find('/'), std::string::npos) << refused.error().message;
  auto bad = small();
  bad.ct.pixel_mm = -1;
  const auto wrong = writePhantomSeries(scratch / "wrong" / "deeper", bad);
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().code, ErrorCode::InvalidArgument);
  EXPECT_FALSE(fs::exists(scratch / "wrong")) << "folders made for nothing go away";
}

/// While it lives, no file of this process may grow beyond `bytes`: a full disk, on demand.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    previous_handler_ = std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, previous_handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
  void (*previous_handler_)(int) = nullptr;
};

TEST(PhantomSeries, LeavesNothingBehindWhereverTheDiskFillsUp) {
  // The report rises once a slice; each run lets one more file be written before the disk is full. Slices are sampled
  // up to 0.9 and written after that.
  const auto options = small();
  const int files = options.ct.dims[2] + 1;
  for (int good = 0; good < files; ++good) {
    const Scratch scratch;
    std::optional<FullDisk> full;
    if (good == 0) full.emplace(1000);
    int written = 0;
    const auto failed = writePhantomSeries(scratch / "s", options, [&](double part) {
      if (part > 0.9 + 1e-9 && ++written == good) full.emplace(100);
    });
    full.reset();
    ASSERT_FALSE(failed) << good;
    EXPECT_EQ(failed.error().code, ErrorCode::Io);
    EXPECT_EQ(failed.error().message, "phantom: cannot write " + (good == files - 1 ? "truth.json" : [&] {
                                        std::array<char, 32> name{};
                                        std::snprintf(name.data(), name.size(), "slice-%03d.dcm", good);
                                        return std::string(name.data());
                                      }()));
    EXPECT_FALSE(fs::exists(scratch / "s")) << good;
  }
}

}  // namespace
}  // namespace spinaltap::dicom_out
