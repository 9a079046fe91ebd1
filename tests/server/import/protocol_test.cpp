// The parent's side of the pipe: a child that lies is found out before memory is spent on it.
#include "server/import/protocol.h"

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/wire/bytes.h"

namespace spinaltap::importer {
namespace {

std::vector<std::byte> frame(FrameType type, const std::vector<std::byte>& payload) {
  wire::ByteWriter out;
  out.u8(static_cast<std::uint8_t>(type));
  out.u32(static_cast<std::uint32_t>(payload.size()));
  out.raw(payload);
  return out.take();
}

AcceptedHeader smallHeader() {
  AcceptedHeader header;
  header.grid.dims = {2, 3, 4};
  header.grid.spacing_mm = {1, 2, 3};
  header.has_label = true;
  return header;
}

void append(std::vector<std::byte>& out, const std::vector<std::byte>& more) {
  out.insert(out.end(), more.begin(), more.end());
}

/// A whole, correct conversation: HU 0, 1, 2, ... and every third voxel inside.
std::vector<std::byte> conversation() {
  wire::ByteWriter hu, label;
  for (std::uint16_t v = 0; v < 24; ++v) hu.u16(static_cast<std::uint16_t>(v - 3));
  for (int v = 0; v < 24; ++v) label.u8(v % 3 == 0 ? 1 : 0);
  std::vector<std::byte> out = frame(FrameType::Accepted, encodeAccepted(smallHeader()));
  append(out, frame(FrameType::Hu, hu.bytes()));
  append(out, frame(FrameType::Label, label.bytes()));
  append(out, frame(FrameType::End, {}));
  return out;
}

TEST(ImportProtocol, PutsAVolumeTogetherFromPiecesOfAnySize) {
  const std::vector<std::byte> whole = conversation();
  for (const std::size_t piece : {std::size_t{1}, std::size_t{7}, whole.size()}) {
    FrameReader reader({}, true);
    for (std::size_t at = 0; at < whole.size(); at += piece) {
      ASSERT_TRUE(reader.feed(std::span(whole).subspan(at, std::min(piece, whole.size() - at))).has_value());
    }
    ASSERT_TRUE(reader.ended());
    const auto volume = reader.take();
    ASSERT_TRUE(volume.has_value());
    EXPECT_EQ(volume->ct.grid, smallHeader().grid);
    EXPECT_EQ(volume->ct.hu[0], -3);
    EXPECT_EQ(volume->ct.hu[23], 20);
    EXPECT_EQ(volume->label->inside[3], 1);
    EXPECT_EQ(volume->label->inside[4], 0);
  }
}

TEST(ImportProtocol, NeverEndsWhenTheStreamIsCut) {
  const std::vector<std::byte> whole = conversation();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    FrameReader reader({}, true);
    ASSERT_TRUE(reader.feed(std::span(whole).first(size)).has_value());
    EXPECT_FALSE(reader.ended()) << size;
  }
}

TEST(ImportProtocol, FindsVoxelsThatAreMissingOrTooMany) {
  const std::vector<std::byte> header = frame(FrameType::Accepted, encodeAccepted(smallHeader()));
  FrameReader few({}, true);
  std::vector<std::byte> bytes = header;
  append(bytes, frame(FrameType::End, {}));
  ASSERT_TRUE(few.feed(bytes).has_value());
  EXPECT_FALSE(few.take().has_value());

  FrameReader many({}, true);
  bytes = header;
  append(bytes, frame(FrameType::Hu, std::vector<std::byte>(50)));
  EXPECT_FALSE(many.feed(bytes).has_value());

  FrameReader early({}, true);
  EXPECT_FALSE(early.feed(frame(FrameType::Hu, std::vector<std::byte>(2))).has_value());
}

TEST(ImportProtocol, RefusesAHeaderWithAnImpossibleGridOrAnUnaskedLabel) {
  const auto accepts = [](const AcceptedHeader& header, bool label_asked, const ImportLimits& limits) {
    FrameReader reader(limits, label_asked);
    return reader.feed(frame(FrameType::Accepted, encodeAccepted(header))).has_value();
  };
  EXPECT_TRUE(accepts(smallHeader(), true, {}));
  EXPECT_FALSE(accepts(smallHeader(), false, {}));
  AcceptedHeader header = smallHeader();
  header.grid.dims = {-2, -3, 4};
  EXPECT_FALSE(accepts(header, true, {}));
  header = smallHeader();
  header.grid.direction.col_z = {0, 0, -1};
  EXPECT_FALSE(accepts(header, true, {}));
  header = smallHeader();
  header.grid.dims = {100'000, 100'000, 100'000};
  EXPECT_FALSE(accepts(header, true, {}));
  ImportLimits tight;
  tight.voxels = 23;
  EXPECT_FALSE(accepts(smallHeader(), true, tight));
}

TEST(ImportProtocol, CleansTheTextOfARefusal) {
  wire::ByteWriter payload;
  payload.u8(200);
  for (const char c : std::string("bad\x1b[31m\nfile \xc3\xa9 \"x\\")) payload.u8(static_cast<std::uint8_t>(c));
  FrameReader reader({}, false);
  ASSERT_TRUE(reader.feed(frame(FrameType::Refused, payload.bytes())).has_value());
  ASSERT_TRUE(reader.refused());
  EXPECT_EQ(reader.refusal().message, "bad?[31m?file ?? ?x?");
  EXPECT_LE(static_cast<int>(reader.refusal().code), static_cast<int>(ErrorCode::Limit));
}

TEST(ImportProtocol, EndsCleanlyOnRandomBytes) {
  constexpr std::uint64_t kSeed = 20260701;
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  Random random(kSeed);
  for (int round = 0; round < 2000; ++round) {
    std::vector<std::byte> bytes = conversation();
    const std::uint64_t flips = 1 + random.below(6);
    for (std::uint64_t n = 0; n < flips; ++n) {
      bytes[random.below(bytes.size())] = static_cast<std::byte>(random.below(256));
    }
    FrameReader reader({}, true);
    if (!reader.feed(bytes) || !reader.ended()) continue;
    const auto volume = reader.take();
    if (volume) {
      EXPECT_TRUE(volume::checkGrid(volume->ct.grid).has_value());
    }
  }
}

TEST(ImportProtocol, CarriesARequestUnchanged) {
  ImportRequest request;
  request.from = "/some/where";
  request.label = LabelRequest{"/else/where.nii", 22};
  request.series = 3;
  request.allow_single_slice = true;
  request.limits.voxels = 12345;
  const std::vector<std::byte> bytes = encodeRequest(request);
  const auto back = decodeRequest(bytes);
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(back->from, request.from);
  EXPECT_EQ(back->label->file, request.label->file);
  EXPECT_EQ(back->label->value, 22);
  EXPECT_EQ(back->series, 3);
  EXPECT_TRUE(back->allow_single_slice);
  EXPECT_EQ(back->limits.voxels, 12345u);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(decodeRequest(std::span(bytes).first(size)).has_value()) << size;
  }
}

}  // namespace
}  // namespace spinaltap::importer
