#include "server/jobs/words.h"

#include <charconv>
#include <cmath>

namespace spinaltap::jobs {

std::string_view nextWord(std::string_view& line) {
  const std::size_t begin = line.find_first_not_of(kSeparators);
  if (begin == std::string_view::npos) return {};
  line.remove_prefix(begin);
  const std::string_view word = line.substr(0, line.find_first_of(kSeparators));
  line.remove_prefix(word.size());
  return word;
}

std::optional<double> numberIn(std::string_view word) {
  if (!word.empty() && word.front() == '+') word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return {};
  return value;
}

double shortened(double value) {
  if (value == 0 || !std::isfinite(value)) return value;
  const double scale = std::pow(10, 3 - std::floor(std::log10(std::abs(value))));
  return std::round(value * scale) / scale;
}

bool isHeader(std::string_view line) {
  const std::size_t at = line.find_first_not_of(" \t\r\"");
  if (at == std::string_view::npos) return false;
  std::string_view rest = line.substr(at);
  const bool letter = (rest[0] >= 'a' && rest[0] <= 'z') || (rest[0] >= 'A' && rest[0] <= 'Z') || rest[0] == '_';
  return letter && !numberIn(nextWord(rest));  // "nan" is a number
}

}  // namespace spinaltap::jobs
