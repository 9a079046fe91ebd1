// core/recording/format.h - chunks and columns of FORMAT.md, shared by writer.cpp and reader.cpp alone.
#pragma once
#include <cstdint>
#include <span>

#include "core/base/hash.h"
#include "core/wire/bytes.h"

namespace spinaltap::recording {

inline constexpr std::uint32_t kMagic = 0x31525453;  ///< the bytes 'S' 'T' 'R' '1'
inline constexpr std::uint32_t kVersion = 3, kOldestVersion = 1;
inline constexpr std::uint64_t kMaxPoints = 1ull << 26;
inline constexpr std::size_t kMaxTextBytes = 4096;
inline constexpr std::size_t kInputsPerChunk = 1000;
inline constexpr std::size_t kBytesPerPlainInput = 57;  ///< version 1
inline constexpr std::size_t kChunkHeadBytes = 9, kChunkTailBytes = 8;

enum class Kind : std::uint8_t { Header = 1, Volume = 2, Inputs = 3, End = 4 };
enum class ColumnForm : std::uint8_t { Plain = 0, Runs = 1 };

[[nodiscard]] inline std::uint64_t preambleOf(std::uint32_t version) {
  return kMagic | (static_cast<std::uint64_t>(version) << 32);
}

/// 7 bits a byte, the lowest first; the high bit says that more follow.
inline void putVarint(wire::ByteWriter& out, std::uint32_t value) {
  for (; value >= 0x80; value >>= 7) out.u8(static_cast<std::uint8_t>(value | 0x80));
  out.u8(static_cast<std::uint8_t>(value));
}
/// Above 2^32 - 1, or cut: no disc is that far, so the caller's bound refuses it.
[[nodiscard]] inline std::uint64_t takeVarint(wire::ByteReader& in) {
  std::uint64_t value = 0;
  for (unsigned shift = 0; shift < 35; shift += 7) {
    const std::uint8_t byte = in.u8();
    value |= static_cast<std::uint64_t>(byte & 0x7f) << shift;
    if (byte < 0x80) return in.failed() ? ~0ull : value;
  }
  return ~0ull;
}

[[nodiscard]] inline std::uint64_t headHash(std::uint64_t previous, Kind kind, std::uint32_t size) {
  return combine(previous, static_cast<std::uint64_t>(kind) + 256ull * size);
}

[[nodiscard]] inline std::uint64_t checksum(std::uint64_t previous, Kind kind, std::span<const std::byte> payload) {
  std::uint64_t hash = headHash(previous, kind, static_cast<std::uint32_t>(payload.size()));
  wire::ByteReader in(payload);
  while (in.left() >= 8) hash = combine(hash, in.u64());
  if (in.left() == 0) return hash;
  std::uint64_t last = 0;
  for (unsigned shift = 0; in.left() > 0; shift += 8) last |= static_cast<std::uint64_t>(in.u8()) << shift;
  return combine(hash, last);
}

}  // namespace spinaltap::recording
