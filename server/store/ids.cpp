#include "server/store/ids.h"

#include <sodium.h>

#include <array>
#include <cstdlib>
#include <ctime>

namespace spinaltap::store {
namespace {
constexpr std::string_view kAlphabet = "0123456789abcdefghjkmnpqrstvwxyz";
}

std::string randomId(char kind, std::size_t length) {
  if (sodium_init() < 0) std::abort();  // no source of random numbers: nothing safe can be done
  std::string id(1, kind);
  while (id.size() < length) id += kAlphabet[randombytes_uniform(32)];
  return id;
}

bool isId(std::string_view text) {
  return text.size() >= 2 && text.size() <= 64 && text.find_first_not_of(kAlphabet) == std::string_view::npos;
}

std::string timestamp() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 32> text{};
  return {text.data(), std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &utc)};
}

}  // namespace spinaltap::store
