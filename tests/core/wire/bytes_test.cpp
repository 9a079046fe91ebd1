#include "core/wire/bytes.h"

#include <gtest/gtest.h>

#include <array>

namespace spinaltap::wire {
namespace {

TEST(Bytes, WritesEveryNumberLowByteFirst) {
  ByteWriter out;
  out.u16(0x0102), out.u32(0x03040506), out.u64(0x0708090a0b0c0d0eULL), out.i32(-2), out.f32(1.0f), out.f64(-2.0);
  const std::array<int, 30> expected = {2,   1,   6,   5, 4, 3,    14,   13, 12, 11, 10, 9, 8, 7, 0xfe,
                                        255, 255, 255, 0, 0, 0x80, 0x3f, 0,  0,  0,  0,  0, 0, 0, 0xc0};
  ASSERT_EQ(out.bytes().size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(static_cast<int>(out.bytes()[i]), expected[i]) << i;
}

TEST(Bytes, AnArrayIsTheSameBytesAsItsNumbersOneByOne) {
  const std::array<std::uint32_t, 3> numbers = {1, 0x80000000u, 0x01020304u};
  ByteWriter one, all;
  for (const std::uint32_t n : numbers) one.u32(n);
  all.array(std::span<const std::uint32_t>(numbers));
  EXPECT_EQ(one.bytes(), all.bytes());
  ByteReader in(all.bytes());
  EXPECT_EQ(in.array<std::uint32_t>(3), std::vector<std::uint32_t>(numbers.begin(), numbers.end()));
  EXPECT_FALSE(in.failed());
}

TEST(Bytes, AnArrayLongerThanWhatIsLeftFailsInsteadOfAllocating) {
  const std::array<std::byte, 16> bytes{};
  for (const std::uint64_t count : {3ull, 0x2000000000000001ull, ~0ull}) {  // the second wraps to 8 bytes if multiplied
    ByteReader in(bytes);
    EXPECT_TRUE(in.array<std::uint64_t>(count).empty());
    EXPECT_TRUE(in.failed());
  }
}

TEST(Bytes, ReadingPastTheEndGivesZerosAndSaysSo) {
  const std::array<std::byte, 3> bytes = {std::byte{1}, std::byte{2}, std::byte{3}};
  ByteReader in(bytes);
  EXPECT_EQ(in.u16(), 0x0201);
  EXPECT_FALSE(in.failed());
  in.u64();
  EXPECT_TRUE(in.failed());
  EXPECT_TRUE(in.raw(1).empty());
}

TEST(Bytes, ATextOverItsLimitFails) {
  ByteWriter out;
  out.text("abcd");
  ByteReader fits(out.bytes()), over(out.bytes());
  EXPECT_EQ(fits.text(4), "abcd");
  EXPECT_FALSE(fits.failed());
  EXPECT_EQ(over.text(3), "");
  EXPECT_TRUE(over.failed());
}

}  // namespace
}  // namespace spinaltap::wire
