// core/base/result.h - results that cannot be ignored, and errors of one line.
#pragma once
#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace spinaltap {

enum class ErrorCode {
  InvalidArgument,  ///< a value is outside its stated domain
  NotFinite,        ///< NaN or infinity where a number is needed
  Degenerate,       ///< too few points, zero length, singular
  NotConverged,     ///< the message gives what was reached
  Unsupported,      ///< well formed, but not something this program handles
  Corrupt,          ///< bytes that break their own format
  NotFound,
  Io,
  Limit,  ///< a stated bound on size, time or memory
};

/// `message` is one line: what was wrong, and where. It never holds an absolute path or a patient's name.
struct Error {
  ErrorCode code = ErrorCode::InvalidArgument;
  std::string message;
};

template <class T>
using Result = tl::expected<T, Error>;

[[nodiscard]] inline tl::unexpected<Error> fail(ErrorCode code, std::string message) {
  return tl::unexpected<Error>(Error{code, std::move(message)});
}

}  // namespace spinaltap
