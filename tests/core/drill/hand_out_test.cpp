#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "core/base/random.h"
#include "core/drill/simd_hand_out.h"

namespace spinaltap::drill {
namespace {

/// Runs of all lengths, single bits, and the ends of the word.
std::uint64_t randomWord(Random& random) {
  const auto run = [&] { return (~std::uint64_t{0} >> random.below(64)) << random.below(64); };
  const std::uint64_t a = run(), b = run(), c = run();
  switch (random.below(4)) {
    case 0:
      return a;
    case 1:
      return a ^ b;
    case 2:
      return a & (b ^ c);
    default:
      return (a ^ b) & c & (c >> 1 | b << 2);
  }
}

TEST(HandOut, SaysTheSameAsBitByBit) {
  Random random(20261122);
  for (int round = 0; round < 20000; ++round) {
    const std::uint64_t bits = round == 0 ? 0 : round == 1 ? ~std::uint64_t{0} : randomWord(random);
    const auto first = static_cast<std::uint32_t>(64 * random.below(1 << 25));
    std::array<std::uint16_t, 128> density{};
    for (auto& value : density) {
      value = static_cast<std::uint16_t>(random.below(3) == 0 ? 65535 : random.below(65536));
    }
    std::vector<std::uint32_t> expected;
    std::uint64_t sum = 0;
    for (std::uint32_t b = 0; b < 64; ++b) {
      if (((bits >> b) & 1) == 0) continue;
      expected.push_back(first + b);
      sum += density[b];
    }
    std::array<std::uint32_t, 128> to{};
    const HandedOut out = handOut(bits, first, density.data(), to.data());
    ASSERT_EQ(out.density_sum, sum) << "seed 20261122, round " << round;
    ASSERT_EQ(std::vector<std::uint32_t>(to.begin(), to.begin() + out.count), expected) << "round " << round;
  }
}

TEST(HandOut, SaysOfARowWhatItSaysBitByBit) {
  Random random(20261123);
  for (int round = 0; round < 5000; ++round) {
    const auto count = static_cast<std::uint32_t>(random.below(300)), first = static_cast<std::uint32_t>(round);
    std::vector<std::uint16_t> density(count + 64);
    for (auto& value : density) value = static_cast<std::uint16_t>(65535 - random.below(3));
    std::vector<std::uint32_t> to(count + 64), expected;
    std::uint64_t sum = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
      expected.push_back(first + i);
      sum += density[i];
    }
    ASSERT_EQ(handOutRow(count, first, density.data(), to.data()), sum) << "seed 20261123, round " << round;
    to.resize(count);
    ASSERT_EQ(to, expected) << "round " << round;
  }
}

}  // namespace
}  // namespace spinaltap::drill
