// server/import/child/hu.h - stored cells to HU.
#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "server/import/child/slice.h"

namespace spinaltap::importer {

/// What pixels outside the field of view become: air.
inline constexpr std::int16_t kPaddingHu = -1024;

/// The pixels of one frame. `padded` is raised by the number of padding pixels.
/// @pre cells.size() == rows * columns * bits_allocated / 8, in this machine's byte order.
/// @error Corrupt when a pixel's HU leave 16 bits.
[[nodiscard]] Result<std::vector<std::int16_t>> toHu(std::span<const char> cells, const StoredPixels& pixels,
                                                     const std::string& name, std::size_t& padded);

}  // namespace spinaltap::importer
