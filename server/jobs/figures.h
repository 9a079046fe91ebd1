// server/jobs/figures.h - what a job measured, and how it tells how far it is.
#pragma once
#include <chrono>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string_view>

namespace spinaltap::jobs {

/// Keys in the order in which they are shown; units in the keys.
using Figures = nlohmann::ordered_json;

/// progress(stage, fraction 0..1); may be empty.
using Progress = std::function<void(std::string_view stage, double fraction)>;

/// Seconds since it was made or last asked.
class Stopwatch {
 public:
  double lap_s() {
    const auto now = std::chrono::steady_clock::now();
    const double lap = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return lap;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace spinaltap::jobs
