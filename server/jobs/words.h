// server/jobs/words.h - numbers in lines of text, as spreadsheets and scripts write them.
#pragma once
#include <optional>
#include <string_view>

#include "core/base/result.h"

namespace spinaltap::jobs {

inline constexpr std::string_view kSeparators = " \t\r,;";

/// The next word, cut off the front of `line`; empty at the end.
[[nodiscard]] std::string_view nextWord(std::string_view& line);

/// "1.5", "+2e-3", "nan", "inf". Empty when it is not a number, or too large for one.
[[nodiscard]] std::optional<double> numberIn(std::string_view word);

/// To four significant digits: more would pretend.
[[nodiscard]] double shortened(double value);

/// Calls use(line, its number from 1) for every line that holds something: empty ones and those that begin with # are
/// skipped, and so is a first one that begins with a letter (a header). Stops at the first error and gives it back,
/// with "NAME line N: " before its message; `name` is what the file is called.
template <class Use>
[[nodiscard]] Result<void> eachLine(std::string_view text, std::string_view name, const Use& use);

/// Whether a line names columns instead of giving numbers.
[[nodiscard]] bool isHeader(std::string_view line);

template <class Use>
Result<void> eachLine(std::string_view text, std::string_view name, const Use& use) {
  if (text.substr(0, 3) == "\xef\xbb\xbf") text.remove_prefix(3);  // a byte order mark, as spreadsheets write it
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
    if (Result<void> used = use(line); !used) {
      return fail(used.error().code,
                  std::string(name) + " line " + std::to_string(number) + ": " + used.error().message);
    }
  }
  return {};
}

}  // namespace spinaltap::jobs
