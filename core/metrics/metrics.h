// core/metrics/metrics.h - how well the hole was drilled: deviations from the plan, breach, force, bone lost.
// Not part of the live loop: libm is fine here.
// Grades: Gertzbein and Robbins, "Accuracy of pedicular screw placement in vivo", Spine 15 (1990).
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/field.h"
#include "core/base/frame.h"
#include "core/plan/path.h"
#include "core/point_volume/lattice.h"

namespace spinaltap::metrics {

/// What was asked for, in the path frame: the hole from (0,0,0) to (0,0,length).
struct Plan {
  plan::Bit bit;
  double length_mm = 0;
  point_volume::Lattice lattice;
  std::optional<Frame> frame;  ///< path frame to patient; without it there are no axial and sagittal angles, no breach
};
[[nodiscard]] Plan planOf(const plan::Path& path);

/// One cycle, as session::Input and Output tell it (metrics does not know the session). Refused cycles are not fed.
struct Cycle {
  std::uint64_t t_us = 0;
  Vec3 tip_mm;
  Vec3 axis{0, 0, 1};  ///< any length above zero
  bool spinning = true;
  double thrust_N = 0;
  std::span<const std::uint32_t> removed_indices;
};

/// Of the bit; axis is a unit vector.
struct Pose {
  Vec3 tip_mm, axis;
};

enum class Direction : std::uint8_t { None, Medial, Lateral, Cranial, Caudal, Anterior, Posterior };
[[nodiscard]] std::string_view nameOf(Direction direction);

/// A: none; B: under 2 mm; C: under 4; D: under 6; E: 6 and more. Below 0.01 mm is none: the field is no finer.
[[nodiscard]] char gertzbeinRobbins(double breach_mm);

struct Metrics {
  std::uint64_t cycles = 0, removed = 0, removed_outside_plan = 0;
  double time_s = 0;  ///< first to last cycle
  double peak_thrust_N = 0;
  double mean_thrust_N = 0;  ///< over time, from the first to the last cycle that removed a point
  double mean_feed_mm_per_s =
      0;  ///< depth gained from the first cycle that removed a point to the deepest, over its time
  double removed_mm3 = 0, removed_outside_plan_mm3 = 0;
  // Of the hole; nothing without a cycle of a spinning bit.
  std::optional<double> depth_max_mm;     ///< of the tip, along the path
  std::optional<double> entry_error_mm;   ///< across the path, where the tip first passed the plane of the entry point
  std::optional<double> tip_error_mm;     ///< from the deepest tip to the target, in space
  std::optional<double> angle_error_deg;  ///< between the drilled axis and the path
  std::optional<double> axial_angle_error_deg, sagittal_angle_error_deg;  ///< the same, seen along patient z and x
  std::optional<double> breach_mm, plunge_mm;                             ///< only with a field
  Direction breach_direction = Direction::None;
};

/// Fed cycle by cycle; memory is bounded (some hundred poses are kept for the breach).
///
/// The drilled axis is the line from where the tip first passed the entry plane (z = 0; the first spinning tip when it
/// began beyond it) to the deepest tip of a spinning bit; for holes shallower than 1 mm, the bit's axis at the deepest
/// tip.
class Accumulator {
 public:
  /// @pre the plan's lattice and bit are valid.
  explicit Accumulator(const Plan& plan);
  void add(const Cycle& cycle);

  /// Without a field: what needs none. With one (patient frame, negative inside bone): also
  /// breach = how far the bit's side came out of the bone where the bone's surface runs along the hole (the field's
  ///   gradient at 45 degrees or more to the bit's axis), at stations deeper than one bit diameter;
  /// plunge = how far the tip came out of the bone's far side.
  /// `medial_patient_x` is the sign of patient x toward the middle; 0 takes it from the path (which converges).
  [[nodiscard]] Metrics finish(const Field* field = nullptr, int medial_patient_x = 0) const;

 private:
  void keepPose(const Pose& pose);

  [[nodiscard]] bool isPlanned(std::uint32_t index) const;
  void addForce(const Cycle& cycle);
  void addRemoval(const Cycle& cycle);
  void addPose(const Cycle& cycle);
  void measureHole(Metrics& metrics) const;

  Plan plan_;
  point_volume::DiscTable disc_;
  Metrics sums_;
  std::vector<Pose> poses_;  ///< of the spinning bit beyond the entry plane, stride_mm_ apart
  double stride_mm_ = 0.25;
  std::optional<Vec3> entry_, last_tip_;
  std::optional<Pose> deepest_;
  std::uint64_t first_us_ = 0, last_us_ = 0, deepest_us_ = 0;
  std::optional<std::uint64_t> first_cut_us_;
  std::uint64_t last_cut_us_ = 0;
  double first_cut_depth_mm_ = 0;
  double thrust_integral_Ns_ = 0;         ///< since the first cut
  double thrust_integral_at_cut_Ns_ = 0;  ///< up to the last cut
};

using Value = std::variant<double, std::string>;
using Named = std::vector<std::pair<std::string, Value>>;

/// Ordered, with units in the keys: cycles, time_s, removed, removed_mm3, removed_outside_plan_mm3, peak_thrust_N,
/// mean_thrust_N, mean_feed_mm_per_s; then, where known, depth_max_mm, entry_error_mm, tip_error_mm, angle_error_deg,
/// axial_angle_error_deg, sagittal_angle_error_deg, breach_mm, breach_direction, gertzbein_robbins, plunge_mm.
/// What each means: README.md.
[[nodiscard]] Named named(const Metrics& metrics);
/// One JSON object in that order; numbers in the fewest digits that read back the same.
[[nodiscard]] std::string toJson(const Named& named);

}  // namespace spinaltap::metrics
