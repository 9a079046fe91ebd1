#include "server/jobs/trace.h"

#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>

namespace spinaltap::jobs {
namespace {

constexpr std::size_t kMostPoses = 20'000'000;
constexpr std::string_view kSeparators = " \t\r,;";

/// The next word, cut off the front of `line`; empty at the end.
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
  if (end != word.data() + word.size() || (error != std::errc() && error != std::errc::result_out_of_range)) return {};
  return error == std::errc() ? std::optional(value) : std::nullopt;
}

/// Times may be written as 1000 or 1000.0 or 1e3, but not as 0.5.
std::optional<std::uint64_t> timeIn(std::string_view word) {
  std::uint64_t whole = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), whole);
  if (error == std::errc() && end == word.data() + word.size()) return whole;
  const auto value = numberIn(word);
  if (!value || !(*value >= 0) || *value > 0x1p53 || *value != std::floor(*value)) return {};
  return static_cast<std::uint64_t>(*value);
}

Result<session::Input> parseLine(std::string_view line) {
  constexpr std::array<const char*, 7> kNames{"t_us", "tip x", "tip y", "tip z", "axis x", "axis y", "axis z"};
  session::Input input;
  const std::array<double*, 6> fields{&input.tip_mm.x, &input.tip_mm.y, &input.tip_mm.z,
                                      &input.axis.x,   &input.axis.y,   &input.axis.z};
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    const std::string_view word = nextWord(line);
    std::string shown = ": '";
    shown.append(word.substr(0, 24)).push_back('\'');
    if (word.empty()) {
      return fail(ErrorCode::Corrupt,
                  std::string("7 numbers are needed (t_us, tip x y z, axis x y z), ") + std::to_string(i) + " found");
    }
    if (i == 0) {
      const auto time = timeIn(word);
      if (!time) return fail(ErrorCode::Corrupt, "t_us is not a whole number of microseconds" + shown);
      input.t_us = *time;
      continue;
    }
    const auto number = numberIn(word);
    if (!number) return fail(ErrorCode::Corrupt, std::string(kNames[i]) + " is not a number" + shown);
    *fields[i - 1] = *number;
  }
  if (!nextWord(line).empty()) return fail(ErrorCode::Corrupt, "more than 7 numbers");
  return input;
}

bool isHeader(std::string_view line) {
  const std::size_t at = line.find_first_not_of(" \t\r\"");
  return at != std::string_view::npos &&
         std::string_view("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ_").find(line[at]) !=
             std::string_view::npos;
}

}  // namespace

Result<std::vector<session::Input>> parseTrace(std::string_view text, std::string_view name) {
  if (text.substr(0, 3) == "\xef\xbb\xbf") text.remove_prefix(3);  // a byte order mark, as spreadsheets write it
  std::vector<session::Input> inputs;
  bool first = true;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    const std::size_t begin = line.find_first_not_of(kSeparators);
    if (begin == std::string_view::npos || line[begin] == '#') continue;
    const bool header = first && isHeader(line);
    first = false;
    if (header) continue;
    auto input = parseLine(line);
    if (!input) {
      return fail(input.error().code,
                  std::string(name) + " line " + std::to_string(number) + ": " + input.error().message);
    }
    if (inputs.size() == kMostPoses) return fail(ErrorCode::Limit, std::string(name) + ": over 20 million poses");
    inputs.push_back(*input);
  }
  if (inputs.empty()) return fail(ErrorCode::Corrupt, std::string(name) + ": no poses");
  return inputs;
}

}  // namespace spinaltap::jobs
