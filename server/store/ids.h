// server/store/ids.h - short random names that are easy to read out and to type.
#pragma once
#include <cstddef>
#include <string>
#include <string_view>

namespace spinaltap::store {

/// `kind` and `length - 1` random characters of 0-9 a-z without i, l, o, u (5 bits each, from libsodium).
[[nodiscard]] std::string randomId(char kind, std::size_t length = 8);

/// Could be a name made by randomId: 2 to 64 of its characters. Everything else is refused before it nears a file.
[[nodiscard]] bool isId(std::string_view text);

/// Now, UTC, as 2026-01-31T23:59:59Z.
[[nodiscard]] std::string timestamp();

}  // namespace spinaltap::store
