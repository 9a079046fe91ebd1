// server/http/entity.h - bodies that browsers may keep, resume and take compressed. After RFC 9110.
#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "server/http/message.h"

namespace spinaltap::http {

/// One thing in up to two forms: plain, and gzipped when `packed` or `packed_file` is set.
struct Entity {
  std::shared_ptr<const std::vector<std::byte>> plain, packed;
  std::filesystem::path file, packed_file;  ///< used when `plain` is null
  std::string tag;                          ///< of the content, without quotes
  std::string type, cache_control = "no-cache";
};

/// 200, 206, 304 or 416. A range is taken from the plain form; several ranges at once are answered with the whole.
[[nodiscard]] Response answer(const Request& request, const Entity& entity);

struct ByteRange {
  std::uint64_t first = 0, last = 0;
};
enum class RangeKind { None, One, Unsatisfiable };
/// "bytes=..." against a body of `size` bytes; None for what must be ignored (other units, several ranges, rubbish).
[[nodiscard]] RangeKind parseRange(std::string_view header, std::uint64_t size, ByteRange& range);

/// Whether Accept-Encoding takes gzip.
[[nodiscard]] bool takesGzip(std::string_view accept_encoding);

}  // namespace spinaltap::http
