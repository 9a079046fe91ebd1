#include "server/ws/frames.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "core/base/random.h"

namespace spinaltap::ws {
namespace {

using Bytes = std::vector<std::byte>;
using Got = FrameReader::Got;

Bytes bytesOf(const std::string& text) {
  const auto* data = reinterpret_cast<const std::byte*>(text.data());
  return {data, data + text.size()};
}

Bytes framed(Opcode opcode, const Bytes& payload, Side sender, std::uint32_t mask = 0) {
  wire::ByteWriter out;
  writeFrame(out, opcode, payload, sender, mask);
  return out.take();
}

void feed(FrameReader& reader, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const auto room = reader.room();
    const std::size_t count = std::min(room.size(), bytes.size());
    std::copy_n(bytes.begin(), count, room.begin());
    reader.filled(count);
    bytes = bytes.subspan(count);
  }
}

/// What is read when the bytes come in pieces of `size`.
std::vector<std::pair<Got, Bytes>> readIn(const Bytes& bytes, std::size_t size, Side sender) {
  FrameReader reader(sender);
  std::vector<std::pair<Got, Bytes>> read;
  for (std::size_t at = 0; at < bytes.size(); at += size) {
    feed(reader, std::span(bytes).subspan(at, std::min(size, bytes.size() - at)));
    for (auto frame = reader.next(); frame.got != Got::Nothing; frame = reader.next()) {
      read.emplace_back(frame.got, Bytes(frame.payload.begin(), frame.payload.end()));
      if (frame.got == Got::Malformed || frame.got == Got::TooLarge) return read;
    }
  }
  return read;
}

Bytes joined(std::initializer_list<Bytes> parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

TEST(Frames, ReadTheSameHoweverTheyAreCut) {
  Random random(6455);
  for (const Side side : {Side::Client, Side::Server}) {
    std::vector<std::pair<Got, Bytes>> sent;
    Bytes line;
    for (const std::size_t size : {0u, 1u, 7u, 125u, 126u, 127u, 1000u, 65535u, 65536u, 70000u, 262144u}) {
      Bytes payload(size);
      for (std::byte& v : payload) v = static_cast<std::byte>(random.bits());
      const Bytes frame = framed(Opcode::Binary, payload, side, static_cast<std::uint32_t>(random.bits()));
      line.insert(line.end(), frame.begin(), frame.end());
      sent.emplace_back(Got::Binary, std::move(payload));
    }
    for (const std::size_t size : {13u, 4096u, 1000000u}) EXPECT_EQ(readIn(line, size, side), sent) << size;
    const Bytes start(line.begin(), line.begin() + 600);
    EXPECT_EQ(readIn(start, 1, side), readIn(start, 600, side));
  }
}

TEST(Frames, FragmentsBecomeOneMessageAndControlFramesMayComeBetween) {
  Bytes first = framed(Opcode::Binary, bytesOf("to"), Side::Client, 1),
        last = framed(Opcode::Continuation, bytesOf("her"), Side::Client, 2);
  Bytes middle = framed(Opcode::Continuation, bytesOf("get"), Side::Client, 3);
  first[0] &= std::byte{0x7f}, middle[0] &= std::byte{0x7f};  // not the final one
  const Bytes ping = framed(Opcode::Ping, bytesOf("?"), Side::Client);
  const Bytes line =
      joined({first, ping, middle, last, framed(Opcode::Text, bytesOf("next"), Side::Client), first, last});
  const std::vector<std::pair<Got, Bytes>> expected{{Got::Ping, bytesOf("?")},
                                                    {Got::Binary, bytesOf("together")},
                                                    {Got::Text, bytesOf("next")},
                                                    {Got::Binary, bytesOf("toher")}};
  for (const std::size_t size : {1u, 5u, 1000u}) EXPECT_EQ(readIn(line, size, Side::Client), expected) << size;
}

TEST(Frames, WhatBreaksTheRulesIsMalformed) {
  const Bytes good = framed(Opcode::Binary, bytesOf("x"), Side::Client);
  Bytes reserved = good, opcode = good, cut_ping = framed(Opcode::Ping, {}, Side::Client);
  reserved[0] |= std::byte{0x40};
  opcode[0] = std::byte{0x83};
  cut_ping[0] &= std::byte{0x7f};
  const Bytes unmasked = framed(Opcode::Binary, bytesOf("x"), Side::Server);
  const Bytes lone = framed(Opcode::Continuation, bytesOf("x"), Side::Client);
  Bytes begun = good;
  begun[0] &= std::byte{0x7f};
  for (const Bytes& bad : {reserved, opcode, cut_ping, unmasked, lone, joined({begun, good}),
                           framed(Opcode::Ping, Bytes(126), Side::Client)}) {
    const auto read = readIn(bad, bad.size(), Side::Client);
    ASSERT_FALSE(read.empty());
    EXPECT_EQ(read.back().first, Got::Malformed);
  }
}

TEST(Frames, NothingOverTheBoundIsWaitedFor) {
  wire::ByteWriter header;
  writeFrameHeader(header, Opcode::Binary, kMostMessageBytes + 1, Side::Client);
  header.u32(0);
  EXPECT_EQ(readIn(header.bytes(), 100, Side::Client).at(0).first, Got::TooLarge);
  Bytes half = framed(Opcode::Binary, Bytes(kMostMessageBytes / 2 + 1), Side::Client), rest = half;
  half[0] = std::byte{0x02}, rest[0] = std::byte{0x80};
  EXPECT_EQ(readIn(joined({half, rest}), 5000, Side::Client).at(0).first, Got::TooLarge);
}

TEST(Frames, RandomBytesEndInAMessageOrARefusal) {
  Random random(27);
  for (int i = 0; i < 2000; ++i) {
    Bytes bytes(random.below(300));
    for (std::byte& v : bytes) v = static_cast<std::byte>(random.bits());
    if (!bytes.empty() && random.below(2) == 0) bytes[0] = std::byte{0x82};
    EXPECT_EQ(readIn(bytes, 1, Side::Client), readIn(bytes, 1000, Side::Client));
  }
}

}  // namespace
}  // namespace spinaltap::ws
