// Damaged files from a printed seed: whatever the damage, a volume or one clean line. Each round is a process, so the
// rounds are few; set SPINALTAP_FUZZ_ROUNDS and SPINALTAP_FUZZ_SEED to go on from here.
#include <cstdlib>

#include "core/base/random.h"
#include "tests/server/import/made_files.h"

namespace spinaltap::importer {
namespace {

std::uint64_t setting(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::strtoull(text, nullptr, 10);
}

std::string damaged(std::string bytes, Random& random) {
  const std::uint64_t flips = 1 + random.below(8);
  for (std::uint64_t n = 0; n < flips; ++n) bytes[random.below(bytes.size())] = static_cast<char>(random.below(256));
  if (random.below(8) == 0) bytes.resize(1 + random.below(bytes.size()));
  return bytes;
}

void fuzz(const std::vector<std::string>& files, const char* name) {
  const std::uint64_t seed = setting("SPINALTAP_FUZZ_SEED", 7), rounds = setting("SPINALTAP_FUZZ_ROUNDS", 60);
  std::printf("seed %llu\n", static_cast<unsigned long long>(seed));
  Random random(seed);
  const Scratch scratch;
  for (std::uint64_t round = 0; round < rounds; ++round) {
    ImportRequest request;
    request.from = scratch.write(name, damaged(files[round % files.size()], random));
    request.allow_single_slice = true;
    const auto result = importVolume(request);
    if (result) {
      EXPECT_TRUE(volume::checkGrid(result->ct.grid).has_value()) << "round " << round;
      EXPECT_EQ(result->ct.hu.size(), result->ct.grid.voxels());
    } else {
      expectClean(result.error());
    }
  }
}

TEST(ImportFuzz, EndsDamagedDicomCleanly) {
  DicomElements nested = madeSlice(0);
  nested[{0x0008, 0x1140}] = {"SQ", item({{{0x0008, 0x1150}, {"UI", "1.2.3"}}})};
  fuzz({part10(madeSlice(0)), part10(nested), explicitElements(madeSlice(1))}, "damaged.dcm");
}

TEST(ImportFuzz, EndsDamagedNiftiCleanly) {
  MadeNifti file;
  file.fill<std::int16_t>([](int i, int j, int k) { return i + j + k; });
  fuzz({file.bytes(), gzipped(file.bytes())}, "damaged.nii");
}

TEST(ImportFuzz, EndsDamagedCompressedSlicesCleanly) {
  const std::filesystem::path folder = std::filesystem::path(SPINALTAP_SHARED_DATA) / "dicom/syntaxes";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no ../shared/data";
  std::vector<std::string> files;
  for (const char* name : {"04_deflated.dcm", "05_rle.dcm", "06_jpeg-lossless-sv1.dcm", "08_jpeg-extended-12bit.dcm",
                           "09_jpegls-lossless.dcm", "12_j2k-lossy.dcm"}) {
    files.push_back(readBytes(folder / name));
  }
  fuzz(files, "damaged.dcm");
}

}  // namespace
}  // namespace spinaltap::importer
