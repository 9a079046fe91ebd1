// The first recording ever made in version 1 of the format, kept as it was: it must stay readable, and replay to the
// same hash on every target.
#include <gtest/gtest.h>

#include <array>
#include <sstream>
#include <string>

#include "tests/core/recording/drills.h"

namespace spinaltap::recording {
namespace {

constexpr std::array kGolden = {
#include "tests/core/recording/golden/recording_v1.inc"
};
constexpr std::uint64_t kGoldenHash =
#include "tests/core/recording/golden/recording_v1_hash.inc"
    ;

std::vector<std::byte> goldenBytes() {
  std::vector<std::byte> bytes;
  for (const int b : kGolden) bytes.push_back(static_cast<std::byte>(b));
  return bytes;
}

TEST(GoldenRecording, IsStillReadAndReplaysToTheHashItHad) {
  const auto recording = read(goldenBytes());
  ASSERT_TRUE(recording.has_value()) << recording.error().message;
  EXPECT_TRUE(recording->complete);
  EXPECT_EQ(recording->header.case_id, "c7k2m9xq");
  const auto inputs = mixedInputs(60);
  ASSERT_EQ(recording->inputs.size(), inputs.size());
  for (std::size_t i = 0; i < inputs.size(); ++i) EXPECT_TRUE(sameBits(recording->inputs[i], inputs[i])) << i;
  const auto report = replay(*recording);
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_TRUE(report->verified) << "first difference at cycle " << report->first_difference;
  EXPECT_EQ(report->state_hash, kGoldenHash);
}

/// The two golden files as they would have to be, for a new version of the format; the old ones stay beside the new.
std::string asGoldenFiles(const Recorded& recorded) {
  std::ostringstream out;
  for (std::size_t i = 0; i < recorded.bytes.size(); ++i) {
    out << static_cast<int>(recorded.bytes[i]) << ',' << (i % 32 == 31 ? '\n' : ' ');
  }
  out << "\n0x" << std::hex << recorded.final_hash << "ull\n";
  return out.str();
}

TEST(GoldenRecording, IsWhatTheWriterWritesToday) {
  const Recorded recorded = record(mixedInputs(60), 25);
  EXPECT_TRUE(recorded.bytes == goldenBytes() && recorded.final_hash == kGoldenHash) << asGoldenFiles(recorded);
}

}  // namespace
}  // namespace spinaltap::recording
