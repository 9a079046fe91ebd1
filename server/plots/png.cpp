#include "server/plots/png.h"

#include <zlib.h>

#include <array>
#include <string_view>
#include <vector>

namespace spinaltap::plots {
namespace {

using Bytes = std::vector<std::uint8_t>;

void put32(Bytes& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<std::uint8_t>(value >> shift));
}

void putChunk(Bytes& out, std::string_view type, const Bytes& data) {
  put32(out, static_cast<std::uint32_t>(data.size()));
  const std::size_t from = out.size();
  out.insert(out.end(), type.begin(), type.end());
  out.insert(out.end(), data.begin(), data.end());
  put32(out, static_cast<std::uint32_t>(::crc32(0, out.data() + from, static_cast<uInt>(out.size() - from))));
}

Bytes deflated(const Bytes& plain) {
  uLongf size = ::compressBound(static_cast<uLong>(plain.size()));
  Bytes out(size);
  ::compress2(out.data(), &size, plain.data(), static_cast<uLong>(plain.size()), Z_BEST_COMPRESSION);
  out.resize(size);
  return out;
}

std::string base64(const Bytes& bytes) {
  static constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t n = 0; n < bytes.size(); n += 3) {
    const auto at = [&](std::size_t i) -> std::uint32_t { return n + i < bytes.size() ? bytes[n + i] : 0; };
    const std::uint32_t three = at(0) << 16 | at(1) << 8 | at(2);
    for (std::size_t digit = 0; digit < 4; ++digit) {
      out += n + digit > bytes.size() ? '=' : kDigits[three >> (18 - 6 * digit) & 63];
    }
  }
  return out;
}

}  // namespace

std::string pngAddress(std::span<const std::uint8_t> grey, std::uint32_t width, std::uint32_t height) {
  Bytes rows;
  rows.reserve(grey.size() + height);
  for (std::uint32_t y = 0; y < height; ++y) {
    rows.push_back(0);  // no filter
    const auto row = grey.subspan(static_cast<std::size_t>(y) * width, width);
    rows.insert(rows.end(), row.begin(), row.end());
  }
  Bytes header;
  put32(header, width);
  put32(header, height);
  header.insert(header.end(), {8, 0, 0, 0, 0});  // eight bits of grey
  Bytes out{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  putChunk(out, "IHDR", header);
  putChunk(out, "IDAT", deflated(rows));
  putChunk(out, "IEND", {});
  return "data:image/png;base64," + base64(out);
}

}  // namespace spinaltap::plots
