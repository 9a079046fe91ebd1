#include "server/import/child/hu.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace spinaltap::importer {

namespace {

constexpr std::int32_t kOutside = std::numeric_limits<std::int32_t>::min();

/// Bits above BitsStored may hold an overlay: they do not count.
int storedValue(unsigned cell, const StoredPixels& pixels) {
  const unsigned mask = (1U << pixels.bits_stored) - 1;
  const unsigned value = cell & mask;
  const unsigned sign = 1U << (pixels.bits_stored - 1);
  if (pixels.is_signed && (value & sign) != 0) return static_cast<int>(value) - static_cast<int>(mask) - 1;
  return static_cast<int>(value);
}

bool isPadding(unsigned cell, int value, const StoredPixels& pixels) {
  if (!pixels.padding) return false;
  if (pixels.padding_limit) {
    const auto [low, high] = std::minmax(*pixels.padding, *pixels.padding_limit);
    return value >= low && value <= high;
  }
  // Some scanners pad with a value that needs all of the cell though fewer bits are stored.
  const unsigned whole_cell = static_cast<unsigned>(*pixels.padding) & ((1U << pixels.bits_allocated) - 1);
  return value == *pixels.padding || cell == whole_cell;
}

/// HU of every possible cell; kOutside where they do not fit. Padding is marked in `padding`.
void fillTable(const StoredPixels& pixels, std::vector<std::int32_t>& table, std::vector<bool>& padding) {
  const std::size_t size = std::size_t{1} << pixels.bits_allocated;
  table.assign(size, kOutside);
  padding.assign(size, false);
  for (std::size_t i = 0; i < size; ++i) {
    const auto cell = static_cast<unsigned>(i);
    const int value = storedValue(cell, pixels);
    const double hu = std::round(value * pixels.slope + pixels.intercept);
    if (hu >= -32768 && hu <= 32767) table[i] = static_cast<std::int32_t>(hu);
    if (isPadding(cell, value, pixels)) {
      padding[i] = true;
      table[i] = kPaddingHu;
    }
  }
}

}  // namespace

Result<std::vector<std::int16_t>> toHu(std::span<const char> cells, const StoredPixels& pixels, const std::string& name,
                                       std::size_t& padded) {
  std::vector<std::int32_t> table;
  std::vector<bool> padding;
  fillTable(pixels, table, padding);
  const std::size_t width = static_cast<std::size_t>(pixels.bits_allocated / 8);
  std::vector<std::int16_t> hu(cells.size() / width);
  for (std::size_t i = 0; i < hu.size(); ++i) {
    std::uint16_t cell = static_cast<unsigned char>(cells[i * width]);
    if (width == 2) std::memcpy(&cell, &cells[i * width], sizeof cell);
    if (table[cell] == kOutside) {
      return fail(ErrorCode::Corrupt, name + ": stored value " + std::to_string(storedValue(cell, pixels)) +
                                          " gives HU that do not fit 16 bits");
    }
    padded += padding[cell] ? 1 : 0;
    hu[i] = static_cast<std::int16_t>(table[cell]);
  }
  return hu;
}

}  // namespace spinaltap::importer
