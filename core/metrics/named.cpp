#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "core/metrics/metrics.h"

namespace spinaltap::metrics {
namespace {

/// The fewest digits that read back the same. (Old standard libraries lack to_chars for doubles.)
std::string numberText(double value) {
  if (!std::isfinite(value)) return "null";
  std::array<char, 40> text{};
  for (int digits = 1; digits <= 17; ++digits) {
    std::snprintf(text.data(), text.size(), "%.*g", digits, value + 0.0);
    if (std::strtod(text.data(), nullptr) == value) break;
  }
  return text.data();
}

}  // namespace

std::string_view nameOf(Direction direction) {
  constexpr std::array<std::string_view, 7> kNames = {"none",   "medial",   "lateral",  "cranial",
                                                      "caudal", "anterior", "posterior"};
  return kNames[static_cast<std::size_t>(direction)];
}

char gertzbeinRobbins(double breach_mm) {
  if (breach_mm < 0.01) return 'A';
  if (breach_mm < 2) return 'B';
  if (breach_mm < 4) return 'C';
  return breach_mm < 6 ? 'D' : 'E';
}

Named named(const Metrics& m) {
  Named all = {{"cycles", static_cast<double>(m.cycles)},
               {"time_s", m.time_s},
               {"removed", static_cast<double>(m.removed)},
               {"removed_mm3", m.removed_mm3},
               {"removed_outside_plan_mm3", m.removed_outside_plan_mm3},
               {"peak_thrust_N", m.peak_thrust_N},
               {"mean_thrust_N", m.mean_thrust_N},
               {"mean_feed_mm_per_s", m.mean_feed_mm_per_s}};
  const auto add = [&](const char* key, const std::optional<double>& value) {
    if (value) all.emplace_back(key, *value);
  };
  add("depth_max_mm", m.depth_max_mm);
  add("entry_error_mm", m.entry_error_mm);
  add("tip_error_mm", m.tip_error_mm);
  add("angle_error_deg", m.angle_error_deg);
  add("axial_angle_error_deg", m.axial_angle_error_deg);
  add("sagittal_angle_error_deg", m.sagittal_angle_error_deg);
  if (m.breach_mm) {
    all.emplace_back("breach_mm", *m.breach_mm);
    all.emplace_back("breach_direction", std::string(nameOf(m.breach_direction)));
    all.emplace_back("gertzbein_robbins", std::string(1, gertzbeinRobbins(*m.breach_mm)));
  }
  add("plunge_mm", m.plunge_mm);
  return all;
}

std::string toJson(const Named& named) {
  std::string json = "{";
  for (const auto& [key, value] : named) {
    if (json.size() > 1) json += ',';
    json += '"' + key + "\":";
    const double* number = std::get_if<double>(&value);
    json += number ? numberText(*number) : '"' + std::get<std::string>(value) + '"';  // names need no escapes
  }
  return json + '}';
}

}  // namespace spinaltap::metrics
