#include "server/jobs/trace.h"

#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string>

#include "server/jobs/words.h"

namespace spinaltap::jobs {
namespace {

constexpr std::size_t kMostPoses = 20'000'000;
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

}  // namespace

Result<std::vector<session::Input>> parseTrace(std::string_view text, std::string_view name) {
  std::vector<session::Input> inputs;
  const auto read = eachLine(text, name, [&](std::string_view line) -> Result<void> {
    auto input = parseLine(line);
    if (!input) return tl::unexpected(input.error());
    if (inputs.size() == kMostPoses) return fail(ErrorCode::Limit, "over 20 million poses");
    inputs.push_back(*input);
    return {};
  });
  if (!read) return tl::unexpected(read.error());
  if (inputs.empty()) return fail(ErrorCode::Corrupt, std::string(name) + ": no poses");
  return inputs;
}

}  // namespace spinaltap::jobs
