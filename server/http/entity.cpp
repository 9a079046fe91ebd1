#include "server/http/entity.h"

#include <algorithm>
#include <charconv>

namespace spinaltap::http {
namespace {

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

/// Calls f with each item of a comma-separated header.
template <class F>
void eachItem(std::string_view header, F&& f) {
  while (!header.empty()) {
    const std::size_t comma = header.find(',');
    f(trimmed(header.substr(0, comma)));
    header.remove_prefix(comma == std::string_view::npos ? header.size() : comma + 1);
  }
}

bool matches(std::string_view if_none_match, const std::string& tag) {
  bool found = false;
  eachItem(if_none_match, [&](std::string_view item) {
    if (item.substr(0, 2) == "W/") item.remove_prefix(2);
    found = found || item == "*" || item == "\"" + tag + "\"" || item == "\"" + tag + "-gzip\"";
  });
  return found;
}

std::optional<std::uint64_t> wholeNumber(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

std::uint64_t sizeOf(const std::shared_ptr<const std::vector<std::byte>>& memory, const std::filesystem::path& file) {
  if (memory) return memory->size();
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  return error ? 0 : size;
}

bool rangeWanted(const Request& request, const Entity& entity) {
  if (request.method != "GET" || request.header("range").empty()) return false;
  const std::string_view condition = request.header("if-range");
  return condition.empty() || condition == "\"" + entity.tag + "\"";
}

}  // namespace

bool takesGzip(std::string_view accept_encoding) {
  std::optional<bool> by_name, by_star;
  eachItem(accept_encoding, [&](std::string_view item) {
    const std::size_t semicolon = item.find(';');
    const std::string_view name = trimmed(item.substr(0, semicolon));
    const std::string_view parameters = semicolon == std::string_view::npos ? "" : trimmed(item.substr(semicolon + 1));
    const bool refused =
        parameters.substr(0, 2) == "q=" && parameters.substr(2).find_first_not_of("0.") == std::string_view::npos;
    if (name == "gzip") by_name = !refused;
    if (name == "*") by_star = !refused;
  });
  return by_name.value_or(by_star.value_or(false));
}

RangeKind parseRange(std::string_view header, std::uint64_t size, ByteRange& range) {
  constexpr std::string_view kUnit = "bytes=";
  if (header.substr(0, kUnit.size()) != kUnit) return RangeKind::None;
  const std::string_view spec = trimmed(header.substr(kUnit.size()));
  const std::size_t dash = spec.find('-');
  if (dash == std::string_view::npos || spec.find(',') != std::string_view::npos) return RangeKind::None;
  const auto first = wholeNumber(spec.substr(0, dash)), last = wholeNumber(spec.substr(dash + 1));
  if (dash == 0) {  // the last so many bytes
    if (!last) return RangeKind::None;
    if (*last == 0 || size == 0) return RangeKind::Unsatisfiable;
    range = {size - std::min(*last, size), size - 1};
    return RangeKind::One;
  }
  if (!first || (!last && dash + 1 != spec.size()) || (last && *last < *first)) return RangeKind::None;
  if (*first >= size) return RangeKind::Unsatisfiable;
  range = {*first, last ? std::min(*last, size - 1) : size - 1};
  return RangeKind::One;
}

Response answer(const Request& request, const Entity& entity) {
  const bool has_packed = entity.packed || !entity.packed_file.empty();
  Response response;
  response.headers = {{"Cache-Control", entity.cache_control}, {"Accept-Ranges", "bytes"}};
  if (has_packed) response.headers.emplace_back("Vary", "Accept-Encoding");
  const bool ranged = rangeWanted(request, entity);
  const bool pack = has_packed && !ranged && takesGzip(request.header("accept-encoding"));
  response.headers.emplace_back("ETag", "\"" + entity.tag + (pack ? "-gzip\"" : "\""));
  if (matches(request.header("if-none-match"), entity.tag)) {
    response.status = 304;
    return response;
  }
  response.headers.emplace_back("Content-Type", entity.type);
  response.memory = pack ? entity.packed : entity.plain;
  if (!response.memory) response.file = pack ? entity.packed_file : entity.file;
  response.length = sizeOf(response.memory, response.file);
  if (pack) response.headers.emplace_back("Content-Encoding", "gzip");
  ByteRange range;
  const std::string size = std::to_string(response.length);
  switch (ranged ? parseRange(request.header("range"), response.length, range) : RangeKind::None) {
    case RangeKind::None:
      break;
    case RangeKind::One:
      response.status = 206;
      response.offset = range.first;
      response.length = range.last - range.first + 1;
      response.headers.emplace_back(
          "Content-Range", "bytes " + std::to_string(range.first) + "-" + std::to_string(range.last) + "/" + size);
      break;
    case RangeKind::Unsatisfiable:
      response = problem(416, "the body has " + size + " bytes");
      response.headers.emplace_back("Content-Range", "bytes */" + size);
  }
  return response;
}

}  // namespace spinaltap::http
