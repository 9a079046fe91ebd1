// tests/core/wire/golden.h - the bytes of server/contract/golden, by name.
#pragma once
#include <cstddef>
#include <map>
#include <string>
#include <vector>

namespace spinaltap::wire {

/// Hex digits to bytes; blanks and everything from '#' to the end of a line are skipped.
inline std::vector<std::byte> fromHex(const std::string& text) {
  std::vector<std::byte> bytes;
  int high = -1;
  bool comment = false;
  for (const char c : text) {
    if (c == '#') comment = true;
    if (c == '\n') comment = false;
    const int digit = c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
    if (comment || digit < 0) continue;
    if (high < 0) {
      high = digit;
    } else {
      bytes.push_back(static_cast<std::byte>(16 * high + digit));
      high = -1;
    }
  }
  return bytes;
}

inline const std::map<std::string, std::vector<std::byte>>& golden() {
  static const std::map<std::string, std::vector<std::byte>> all = [] {
    const std::vector<std::pair<const char*, const char*>> texts = {
#include "golden_bytes.inc"
    };
    std::map<std::string, std::vector<std::byte>> bytes;
    for (const auto& [name, text] : texts) bytes[name] = fromHex(text);
    return bytes;
  }();
  return all;
}

}  // namespace spinaltap::wire
