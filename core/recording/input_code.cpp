#include "core/recording/input_code.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace spinaltap::recording {
namespace {

constexpr std::size_t kColumns = 8;  // t_us, tip x y z, axis x y z, flags
constexpr std::size_t kTime = 0, kAxisX = 4, kAxisZ = 6, kFlags = 7;
constexpr unsigned kUnit = 15;  // the way that takes a unit vector's last component from the others
constexpr unsigned kWayBits = 4, kShiftBits = 6;
constexpr std::size_t kRowsTried = 200;
constexpr unsigned kMiddle = 32;  // expected length of a column's first number
constexpr std::uint64_t kSign = 1ull << 63;

/// Signed binomial coefficients: the next value of a polynomial of degree m - 1 is the sum of kWeights[m][k] times the
/// k+1-th value back.
constexpr auto kWeights = [] {
  std::array<std::array<std::int32_t, kCodeMemory>, kCodeMemory + 1> weights{};
  for (std::size_t m = 1; m <= kCodeMemory; ++m) {
    std::int32_t choose = 1;
    for (std::size_t k = 0; k < m; ++k) {
      choose = static_cast<std::int32_t>(choose * static_cast<std::int32_t>(m - k) / static_cast<std::int32_t>(k + 1));
      weights[m][k] = k % 2 == 0 ? choose : -choose;
    }
  }
  return weights;
}();

double doubleOf(std::uint64_t bits) {
  double value = 0;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}
std::uint64_t bitsAsTheyAre(double value) {
  std::uint64_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  return bits;
}

using Words = std::vector<std::uint64_t>;
using Table = std::array<Words, kColumns>;

void append(const session::Input& input, Table& table) {
  std::size_t column = 0;
  table[column++].push_back(input.t_us);
  for (const double v : {input.tip_mm.x, input.tip_mm.y, input.tip_mm.z, input.axis.x, input.axis.y, input.axis.z}) {
    table[column++].push_back(bitsAsTheyAre(v));
  }
  table[column].push_back(input.spinning ? 1 : 0);
}

session::Input inputAt(const Table& table, std::size_t row) {
  const auto at = [&](std::size_t column) { return doubleOf(table[column][row]); };
  return {table[kTime][row], {at(1), at(2), at(3)}, {at(4), at(5), at(6)}, table[kFlags][row] == 1};
}

bool isDouble(std::size_t column) { return column != kTime && column != kFlags; }

/// Numbers in the order of their values, so that a near miss is a small difference; the `shift` low bits, which are 0
/// in the whole column, are dropped. A bijection, -0 beside 0 included.
std::uint64_t ordered(std::size_t column, std::uint64_t bits, unsigned shift) {
  if (!isDouble(column)) return bits;
  const std::uint64_t size = (bits & ~kSign) >> shift;
  return (bits & kSign) != 0 ? ~size : size;
}
std::uint64_t unordered(std::size_t column, std::uint64_t value, unsigned shift) {
  if (!isDouble(column)) return value;
  return (value & kSign) != 0 ? (~value << shift) | kSign : value << shift;
}

/// Small numbers of either sign to small numbers.
std::uint64_t zigzag(std::uint64_t v) { return (v << 1) ^ (0 - (v >> 63)); }
std::uint64_t unzigzag(std::uint64_t v) { return (v >> 1) ^ (0 - (v & 1)); }

/// What the number at `row` of `column` should be, from the rows above it and the columns to its left.
std::uint64_t foretold(const Table& table, std::size_t column, std::size_t row, unsigned way) {
  const Words& words = table[column];
  if (row == 0) return 0;
  if (!isDouble(column)) {
    std::uint64_t sum = 0;  // modulo 2^64
    const std::size_t order = std::min<std::size_t>(way, row);
    for (std::size_t k = 0; k < order; ++k) {
      sum += static_cast<std::uint64_t>(std::int64_t{kWeights[order][k]}) * words[row - 1 - k];
    }
    return sum;
  }
  double guess = 0;
  if (way == kUnit) {
    const double x = doubleOf(table[kAxisX][row]), y = doubleOf(table[kAxisX + 1][row]);
    guess = std::sqrt(1.0 - x * x - y * y);
    if ((words[row - 1] & kSign) != 0) guess = -guess;
  } else {
    const std::size_t order = std::min<std::size_t>(way, row);
    for (std::size_t k = 0; k < order; ++k) guess += kWeights[order][k] * doubleOf(words[row - 1 - k]);
  }
  // A NaN's bits are the machine's own.
  return std::isfinite(guess) ? bitsAsTheyAre(guess) : words[row - 1];
}

unsigned lengthOf(std::uint64_t v) {
  unsigned length = 0;
  for (unsigned half = 32; half > 0; half /= 2) {
    if ((v >> half) != 0) v >>= half, length += half;
  }
  return length + (v != 0 ? 1 : 0);
}

/// How many bits long the next number should be: a running mean in sixteenths.
class Expected {
 public:
  [[nodiscard]] unsigned length() const { return (mean_ + 8) >> 4; }
  void learn(unsigned length) { mean_ = mean_ - (mean_ >> 3) + 2 * length; }

 private:
  unsigned mean_ = kMiddle << 4;
};

/// 0, 1, -1, 2, -2 ... as 0 1 2 3 4.
unsigned surprise(unsigned length, unsigned expected) {
  return length > expected ? 2 * (length - expected) - 1 : 2 * (expected - length);
}

class BitWriter {
 public:
  explicit BitWriter(wire::ByteWriter& out) : out_(out) {}
  void put(std::uint64_t value, unsigned bits) {
    for (; bits > 0; --bits) {
      byte_ |= static_cast<unsigned>(value & 1) << filled_;
      value >>= 1;
      if (++filled_ == 8) flush();
    }
  }
  void flush() {
    if (filled_ > 0) out_.u8(static_cast<std::uint8_t>(byte_));
    byte_ = 0, filled_ = 0;
  }

 private:
  wire::ByteWriter& out_;
  unsigned byte_ = 0, filled_ = 0;
};

class BitReader {
 public:
  explicit BitReader(std::span<const std::byte> bytes) : bytes_(bytes) {}
  std::uint64_t get(unsigned bits) {
    std::uint64_t value = 0;
    for (unsigned i = 0; i < bits; ++i, ++at_) {
      if (at_ / 8 >= bytes_.size()) {
        failed_ = true;
        return 0;
      }
      value |= ((static_cast<std::uint64_t>(bytes_[at_ / 8]) >> (at_ % 8)) & 1) << i;
    }
    return value;
  }
  [[nodiscard]] bool failed() const { return failed_; }
  /// All read but the last byte's filling, and that is zeros.
  [[nodiscard]] bool finished() {
    while (!failed_ && at_ % 8 != 0) failed_ = get(1) != 0;
    return !failed_ && at_ / 8 == bytes_.size();
  }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  bool failed_ = false;
};

/// What the rows from `first` on miss by, as zigzag.
Words missedBy(const Table& table, std::size_t column, std::size_t first, unsigned way, unsigned shift) {
  Words missed;
  missed.reserve(table[column].size() - first);
  for (std::size_t row = first; row < table[column].size(); ++row) {
    const std::uint64_t guess = ordered(column, foretold(table, column, row, way), shift);
    missed.push_back(zigzag(ordered(column, table[column][row], shift) - guess));
  }
  return missed;
}

std::uint64_t bitsFor(const Words& missed) {
  Expected expected;
  std::uint64_t bits = 0;
  for (const std::uint64_t number : missed) {
    const unsigned length = lengthOf(number);
    bits += surprise(length, expected.length()) + std::max(length, 1u);
    expected.learn(length);
  }
  return bits;
}

/// The cheapest way, judged by the last rows alone.
unsigned bestWay(const Table& table, std::size_t column, std::size_t first, unsigned shift) {
  first = std::max(first, table[column].size() - std::min(table[column].size(), kRowsTried));
  unsigned best = 1;
  std::uint64_t least = ~0ull;
  const auto consider = [&](unsigned way) {
    const std::uint64_t bits = bitsFor(missedBy(table, column, first, way, shift));
    if (bits < least) least = bits, best = way;
  };
  for (const unsigned way : {1u, 2u, 3u, 4u, 6u, 8u, 10u, 12u}) {
    if (isDouble(column) || way <= 3) consider(way);
  }
  if (column == kAxisZ) consider(kUnit);
  return best;
}

/// The low bits that are 0 in all of the column: a device that reports floats leaves 29 of them.
unsigned sharedZeros(const Words& words, std::size_t first) {
  std::uint64_t any = 1ull << 62;  // at most 62, so that a size never loses all of its bits
  for (std::size_t row = first; row < words.size(); ++row) any |= words[row] & ~kSign;
  unsigned zeros = 0;
  while (((any >> zeros) & 1) == 0) ++zeros;
  return zeros;
}

void encodeColumn(const Table& table, std::size_t column, std::size_t first, BitWriter& out) {
  const unsigned shift = isDouble(column) ? sharedZeros(table[column], first) : 0;
  const unsigned way = bestWay(table, column, first, shift);
  const Words missed = missedBy(table, column, first, way, shift);
  const bool perfect = std::all_of(missed.begin(), missed.end(), [](std::uint64_t number) { return number == 0; });
  out.put(way, kWayBits), out.put(shift, kShiftBits), out.put(perfect ? 1 : 0, 1);
  if (perfect) return;
  Expected expected;
  for (const std::uint64_t number : missed) {
    const unsigned length = lengthOf(number);
    for (unsigned ones = surprise(length, expected.length()); ones > 0; --ones) out.put(1, 1);
    out.put(0, 1);
    if (length > 1) out.put(number, length - 1);  // the highest bit is a 1
    expected.learn(length);
  }
}

bool decodeNumber(BitReader& in, Expected& expected, std::uint64_t& missed) {
  unsigned ones = 0;
  while (in.get(1) == 1) {
    if (++ones > 2 * 64) return false;
  }
  const unsigned by = (ones + 1) / 2;
  if (ones % 2 == 0 && by > expected.length()) return false;
  const unsigned length = ones % 2 == 1 ? expected.length() + by : expected.length() - by;
  if (length > 64) return false;
  missed = length < 2 ? length : in.get(length - 1) | (1ull << (length - 1));
  expected.learn(length);
  return !in.failed();
}

bool decodeColumn(BitReader& in, Table& table, std::size_t column, std::size_t count) {
  const auto way = static_cast<unsigned>(in.get(kWayBits)), shift = static_cast<unsigned>(in.get(kShiftBits));
  const bool perfect = in.get(1) == 1;
  const bool known = (way >= 1 && way <= kCodeMemory) || (way == kUnit && column == kAxisZ);
  if (in.failed() || !known || shift > (isDouble(column) ? 62u : 0u)) return false;
  Expected expected;
  for (std::size_t i = 0; i < count; ++i) {
    std::uint64_t missed = 0;
    if (!perfect && !decodeNumber(in, expected, missed)) return false;
    const std::uint64_t guess = ordered(column, foretold(table, column, table[column].size(), way), shift);
    table[column].push_back(unordered(column, guess + unzigzag(missed), shift));
  }
  return true;
}

Table tableOf(std::span<const session::Input> before) {
  Table table;
  for (std::size_t i = before.size() - std::min(before.size(), kCodeMemory); i < before.size(); ++i) {
    append(before[i], table);
  }
  return table;
}

}  // namespace

void encodeInputs(std::span<const session::Input> before, std::span<const session::Input> inputs,
                  wire::ByteWriter& out) {
  Table table = tableOf(before);
  const std::size_t first = table[0].size();
  for (const session::Input& input : inputs) append(input, table);
  BitWriter bits(out);
  for (std::size_t column = 0; column < kColumns; ++column) encodeColumn(table, column, first, bits);
  bits.flush();
}

bool decodeInputs(std::span<const std::byte> code, std::size_t count, std::vector<session::Input>& inputs) {
  Table table = tableOf(inputs);
  const std::size_t first = table[0].size();
  BitReader bits(code);
  for (std::size_t column = 0; column < kColumns; ++column) {
    if (!decodeColumn(bits, table, column, count)) return false;
  }
  if (!bits.finished()) return false;
  for (std::size_t row = first; row < first + count; ++row) {
    if (table[kFlags][row] > 1) return false;
    inputs.push_back(inputAt(table, row));
  }
  return true;
}

}  // namespace spinaltap::recording
