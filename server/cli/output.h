// server/cli/output.h - figures on standard output, progress and errors on standard error.
#pragma once
#include <chrono>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "server/jobs/figures.h"
#include "server/store/store.h"

namespace spinaltap::cli {

/// With `json`, exactly one object on one line; else a line a figure, long lists cut short.
void print(const jobs::Figures& figures, bool json);
/// "spinaltap: message", one line whatever the message holds.
void printError(std::string_view message);

/// Drawn only when standard error is a terminal, at most ten times a second, and wiped away at the end.
class ProgressBar {
 public:
  ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  ~ProgressBar() { wipe(); }
  void show(std::string_view stage, double fraction);
  void wipe();
  [[nodiscard]] jobs::Progress callback();

 private:
  bool terminal_ = false, drawn_ = false;
  std::string stage_;
  std::chrono::steady_clock::time_point last_{};
};

}  // namespace spinaltap::cli
