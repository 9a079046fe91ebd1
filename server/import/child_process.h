// server/import/child_process.h - runs spinaltap-import with three pipes and a deadline.
#pragma once
#include <chrono>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace spinaltap::importer {

struct ChildEnd {
  bool timed_out = false;      ///< killed at the deadline
  bool stopped_early = false;  ///< killed because `output` said so
  int signal = 0;              ///< that ended it, 0 if none
  int exit_code = 0;
  long max_resident_kib = 0;
};

struct ChildStreams {
  /// Bytes of its standard output as they come; false kills it.
  std::function<bool(std::span<const std::byte>)> output;
  /// Whole lines of its descriptor 3.
  std::function<void(const std::string&)> progress_line;
};

/// Starts `program` with an empty environment, nothing but the pipes open, in a process group of its own, hands it
/// `input` on standard input and reads until both pipes close. Always reaps it.
/// @error Io when it cannot be started.
[[nodiscard]] Result<ChildEnd> runChild(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                                        std::span<const std::byte> input, std::chrono::milliseconds deadline,
                                        const ChildStreams& streams);

/// spinaltap-import beside the running program.
[[nodiscard]] std::filesystem::path defaultChildProgram();

}  // namespace spinaltap::importer
