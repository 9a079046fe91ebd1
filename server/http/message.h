// server/http/message.h - a request and its answer as plain values, so that routes are tested without sockets.
#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace spinaltap::http {

struct Request {
  std::string method;                          ///< as sent: "GET"
  std::string path;                            ///< decoded, without the query: "/api/v1/cases"
  std::map<std::string, std::string> headers;  ///< names in lower case
  std::string body;

  [[nodiscard]] std::string_view header(const std::string& lower_case_name) const {
    const auto found = headers.find(lower_case_name);
    return found == headers.end() ? std::string_view{} : std::string_view(found->second);
  }
};

struct Response {
  int status = 200;
  std::vector<std::pair<std::string, std::string>> headers;
  /// The body: `text`, or else `length` bytes from `offset` of `memory` or of `file`.
  std::string text;
  std::shared_ptr<const std::vector<std::byte>> memory;
  std::filesystem::path file;
  std::uint64_t offset = 0, length = 0;

  [[nodiscard]] std::uint64_t contentLength() const { return memory || !file.empty() ? length : text.size(); }
};

/// RFC 9457. `detail` is one sentence that a person can read.
[[nodiscard]] Response problem(int status, const std::string& detail);

/// Of the request line: percent-decoded, the query cut off. Empty when it is malformed, holds a NUL or a backslash, or
/// has a segment "." or "..".
[[nodiscard]] std::string decodePath(std::string_view target);

[[nodiscard]] const char* reasonOf(int status);

}  // namespace spinaltap::http
