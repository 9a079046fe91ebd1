// Recordings of the first and of every later version of the format, kept as they were: they must stay readable. Those
// of today's version must replay to the same hash on every target.
#include <gtest/gtest.h>

#include <array>
#include <span>
#include <sstream>
#include <string>

#include "tests/core/recording/drills.h"

namespace spinaltap::recording {
namespace {

constexpr std::array kVersion1 = {
#include "tests/core/recording/golden/recording_v1.inc"
};
constexpr std::uint64_t kHash1 =
#include "tests/core/recording/golden/recording_v1_hash.inc"
    ;
constexpr std::array kVersion2 = {
#include "tests/core/recording/golden/recording_v2.inc"
};
constexpr std::uint64_t kHash2 =
#include "tests/core/recording/golden/recording_v2_hash.inc"
    ;
constexpr std::array kVersion3 = {
#include "tests/core/recording/golden/recording_v3.inc"
};
constexpr std::uint64_t kHash3 =
#include "tests/core/recording/golden/recording_v3_hash.inc"
    ;

std::vector<std::byte> asBytes(std::span<const int> numbers) {
  std::vector<std::byte> bytes;
  for (const int b : numbers) bytes.push_back(static_cast<std::byte>(b));
  return bytes;
}

void expectTheGoldenDrill(const Recording& recording, std::uint32_t version, std::uint64_t hash) {
  EXPECT_TRUE(recording.complete);
  EXPECT_EQ(recording.version, version);
  EXPECT_EQ(recording.header.case_id, "c7k2m9xq");
  EXPECT_EQ(recording.volume.alive, smallVolume().alive);
  const auto inputs = mixedInputs(60);
  ASSERT_EQ(recording.inputs.size(), inputs.size());
  for (std::size_t i = 0; i < inputs.size(); ++i) EXPECT_TRUE(sameBits(recording.inputs[i], inputs[i])) << i;
  ASSERT_EQ(recording.checkpoints.size(), 3u);
  EXPECT_EQ(recording.checkpoints[0].inputs, 25u);
  EXPECT_EQ(recording.checkpoints[2].inputs, 60u);
  EXPECT_EQ(recording.checkpoints[2].state_hash, hash);
}

TEST(GoldenRecording, OfVersion1IsStillReadAndReplaysButItsHashesOfAnEarlierCoreSayNothing) {
  const auto recording = read(asBytes(kVersion1));
  ASSERT_TRUE(recording.has_value()) << recording.error().message;
  expectTheGoldenDrill(*recording, 1, kHash1);
  const auto report = replay(*recording);
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_FALSE(report->verified);
  EXPECT_FALSE(report->comparable);
  EXPECT_EQ(report->first_difference, 0u);
  EXPECT_EQ(report->cycles, recording->checkpoints[2].cycle);
  EXPECT_EQ(report->state_hash, kHash3) << "the same drill, as this core hashes it";
}

TEST(GoldenRecording, OfVersion1WithHashesOfThisCoreIsVerified) {
  Recording recording = *read(asBytes(kVersion1));
  const Recording today = *read(asBytes(kVersion3));
  for (std::size_t i = 0; i < 3; ++i) recording.checkpoints[i].state_hash = today.checkpoints[i].state_hash;
  EXPECT_TRUE(replay(recording)->verified);
}

TEST(GoldenRecording, OfVersion1WithAFlippedBitIsCorrupt) {
  for (std::size_t at = 8; at < kVersion1.size(); ++at) {
    auto bytes = asBytes(kVersion1);
    bytes[at] ^= static_cast<std::byte>(1u << (at % 8));
    EXPECT_EQ(read(bytes).error().code, ErrorCode::Corrupt) << at;
  }
}

TEST(GoldenRecording, OfVersion2IsVerifiedByWhatItRemovedThoughItsHashesHoldAnotherForce) {
  const auto recording = read(asBytes(kVersion2));
  ASSERT_TRUE(recording.has_value()) << recording.error().message;
  expectTheGoldenDrill(*recording, 2, kHash2);
  EXPECT_FALSE(recording->header.config.coupling.has_value());
  const auto report = replay(*recording);
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_TRUE(report->verified) << "first difference at cycle " << report->first_difference;
  EXPECT_EQ(report->state_hash, kHash3) << "the same drill, as this core hashes it";
}

TEST(GoldenRecording, OfVersion2WithAnotherPoseIsNotVerified) {
  Recording recording = *read(asBytes(kVersion2));
  for (session::Input& input : recording.inputs) input.tip_mm.x += 0.3;
  const auto report = replay(recording);
  EXPECT_FALSE(report->verified);
  EXPECT_FALSE(report->discs.empty());
}

TEST(GoldenRecording, OfVersion3ReplaysToTheHashItHad) {
  const auto recording = read(asBytes(kVersion3));
  ASSERT_TRUE(recording.has_value()) << recording.error().message;
  expectTheGoldenDrill(*recording, 3, kHash3);
  const auto report = replay(*recording);
  ASSERT_TRUE(report.has_value()) << report.error().message;
  EXPECT_TRUE(report->verified) << "first difference at cycle " << report->first_difference;
  EXPECT_EQ(report->state_hash, kHash3);
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
  EXPECT_TRUE(recorded.bytes == asBytes(kVersion3) && recorded.final_hash == kHash3) << asGoldenFiles(recorded);
}

}  // namespace
}  // namespace spinaltap::recording
