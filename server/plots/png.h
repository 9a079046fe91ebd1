// server/plots/png.h - a grey picture that fits into a line of SVG.
#pragma once
#include <cstdint>
#include <span>
#include <string>

namespace spinaltap::plots {

/// "data:image/png;base64,...". @pre grey.size() == width * height > 0, row by row.
[[nodiscard]] std::string pngAddress(std::span<const std::uint8_t> grey, std::uint32_t width, std::uint32_t height);

}  // namespace spinaltap::plots
