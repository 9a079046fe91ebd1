// server/jobs/trace.h - poses from a CSV file: t_us, tip x y z, axis x y z, in the path frame.
#pragma once
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/session/session.h"

namespace spinaltap::jobs {

/// A line a pose: seven numbers separated by commas, semicolons, blanks or tabs. Empty lines and lines that begin with
/// # are skipped, and so is a first line that begins with a letter (a header). Times are whole microseconds. Whether a
/// pose makes sense is for the session to say: "nan" and "inf" are numbers here.
/// @error Corrupt ("FILE line 12: ..."; `name` is what FILE is called), Limit (over 20 million poses).
[[nodiscard]] Result<std::vector<session::Input>> parseTrace(std::string_view text, std::string_view name);

}  // namespace spinaltap::jobs
