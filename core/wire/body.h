// core/wire/body.h - what the three bodies (mesh, volume, point volume) have in common: a magic, a version, no rest.
#pragma once
#include <cstdint>
#include <string>

#include "core/base/result.h"
#include "core/wire/bytes.h"

namespace spinaltap::wire {

[[nodiscard]] inline tl::unexpected<Error> corrupt(const char* what, std::size_t offset, const std::string& why) {
  return fail(ErrorCode::Corrupt, std::string(what) + ": " + why + " at byte " + std::to_string(offset));
}

/// Reads magic and version 1.
[[nodiscard]] inline Result<std::uint32_t> readPreamble(ByteReader& in, const char* what, std::uint32_t magic,
                                                        std::uint32_t newest = 1) {
  const std::uint32_t found = in.u32(), version = in.u32();
  if (in.failed()) return corrupt(what, in.offset(), "ends within its first eight bytes");
  if (found != magic) return corrupt(what, 0, "wrong magic number");
  if (version < 1 || version > newest) {
    return fail(ErrorCode::Unsupported, std::string(what) + ": version " + std::to_string(version));
  }
  return version;
}

/// After the last field.
[[nodiscard]] inline Result<void> checkEnd(const ByteReader& in, const char* what) {
  if (in.failed()) return corrupt(what, in.offset(), "ends too early");
  if (in.left() != 0) return corrupt(what, in.offset(), std::to_string(in.left()) + " bytes left over");
  return {};
}

}  // namespace spinaltap::wire
