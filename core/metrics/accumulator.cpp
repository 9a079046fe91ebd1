#include <algorithm>
#include <cmath>

#include "core/base/dmath.h"
#include "core/metrics/breach.h"
#include "core/metrics/metrics.h"

namespace spinaltap::metrics {
namespace {

constexpr std::size_t kMostPoses = 256;
constexpr double kSwayLever_mm = 20.0;  // how far up the shaft a change of the axis is felt as a motion
constexpr double kShallow_mm = 1.0;
constexpr double kTouch_mm = 1e-9;  // as drill::kTouch_mm: a ring as wide as the hole belongs to it
constexpr double kShortest = 1e-6;

double acrossPath(const Vec3& p) { return std::sqrt(p.x * p.x + p.y * p.y); }
double seconds(std::uint64_t from_us, std::uint64_t to_us) { return static_cast<double>(to_us - from_us) * 1e-6; }

double angleBetween_deg(const Vec3& a, const Vec3& b) {
  return std::atan2(norm(cross(a, b)), dot(a, b)) * (180.0 / kPi);
}

/// In the plane without the given patient axis; nothing where one of them has no length there.
std::optional<double> angleInPlane_deg(Vec3 a, Vec3 b, double Vec3::* axis) {
  a.*axis = 0, b.*axis = 0;
  if (norm(a) < kShortest || norm(b) < kShortest) return std::nullopt;
  return angleBetween_deg(a, b);
}

}  // namespace

Plan planOf(const plan::Path& path) {
  return {path.bit, plan::length(path), point_volume::latticeOf(path), plan::pathFrame(path)};
}

Accumulator::Accumulator(const Plan& plan) : plan_(plan), disc_(point_volume::discTable(plan.lattice)) {}

void Accumulator::add(const Cycle& cycle) {
  addForce(cycle);
  addRemoval(cycle);
  addPose(cycle);
  ++sums_.cycles;
  last_us_ = cycle.t_us;
}

void Accumulator::addForce(const Cycle& cycle) {
  if (sums_.cycles == 0) first_us_ = last_us_ = cycle.t_us;
  sums_.peak_thrust_N = std::max(sums_.peak_thrust_N, cycle.thrust_N);
  if (first_cut_us_) thrust_integral_Ns_ += cycle.thrust_N * seconds(last_us_, cycle.t_us);
}

void Accumulator::addRemoval(const Cycle& cycle) {
  if (cycle.removed_indices.empty()) return;
  if (!first_cut_us_) {
    first_cut_us_ = cycle.t_us;
    first_cut_depth_mm_ = cycle.tip_mm.z;
  }
  last_cut_us_ = cycle.t_us;
  thrust_integral_at_cut_Ns_ = thrust_integral_Ns_;
  sums_.removed += cycle.removed_indices.size();
  for (const std::uint32_t index : cycle.removed_indices) sums_.removed_outside_plan += isPlanned(index) ? 0 : 1;
}

bool Accumulator::isPlanned(std::uint32_t index) const {
  const std::uint32_t per_disc = plan_.lattice.pointsPerDisc(), in_disc = index % per_disc;
  const double behind_target = plan_.length_mm - plan_.lattice.discZ_mm(static_cast<int>(index / per_disc));
  if (behind_target < -kTouch_mm) return false;
  const plan::Bit& bit = plan_.bit;
  const double part = behind_target < bit.cone_length_mm ? behind_target / bit.cone_length_mm : 1.0;
  return acrossPath({disc_.x_mm[in_disc], disc_.y_mm[in_disc], 0}) <= part * bit.diameter_mm / 2 + kTouch_mm;
}

void Accumulator::addPose(const Cycle& cycle) {
  if (!cycle.spinning) return;
  const Pose pose{cycle.tip_mm, normalized(cycle.axis)};
  const Vec3& tip = pose.tip_mm;
  if (!entry_ && tip.z >= 0) {
    const bool passed = last_tip_ && last_tip_->z < 0;
    entry_ = passed ? *last_tip_ + (tip - *last_tip_) * (-last_tip_->z / (tip.z - last_tip_->z)) : tip;
  }
  last_tip_ = tip;
  if (!deepest_ || tip.z > deepest_->tip_mm.z) {
    deepest_ = pose;
    deepest_us_ = cycle.t_us;
  }
  if (tip.z > 0) keepPose(pose);
}

void Accumulator::keepPose(const Pose& pose) {
  if (!poses_.empty()) {
    const Pose& last = poses_.back();
    const double motion = std::max(norm(pose.tip_mm - last.tip_mm), kSwayLever_mm * norm(pose.axis - last.axis));
    if (motion < stride_mm_) return;
  }
  if (poses_.size() == kMostPoses) {  // every second one, and from now on twice as far apart
    for (std::size_t i = 0; 2 * i < kMostPoses; ++i) poses_[i] = poses_[2 * i];
    poses_.resize(kMostPoses / 2);
    stride_mm_ *= 2;
  }
  poses_.push_back(pose);
}

void Accumulator::measureHole(Metrics& metrics) const {
  const Vec3& tip = deepest_->tip_mm;
  const Vec3 entry = entry_.value_or(tip);
  metrics.depth_max_mm = tip.z;
  metrics.entry_error_mm = acrossPath(entry);
  metrics.tip_error_mm = norm(tip - Vec3{0, 0, plan_.length_mm});
  const bool deep = tip.z - entry.z >= kShallow_mm;
  const Vec3 axis = deep ? normalized(tip - entry) : deepest_->axis, path{0, 0, 1};
  metrics.angle_error_deg = angleBetween_deg(axis, path);
  if (!plan_.frame) return;
  const Vec3 axis_patient = plan_.frame->directionToPatient(axis);
  const Vec3 path_patient = plan_.frame->directionToPatient(path);
  metrics.axial_angle_error_deg = angleInPlane_deg(axis_patient, path_patient, &Vec3::z);
  metrics.sagittal_angle_error_deg = angleInPlane_deg(axis_patient, path_patient, &Vec3::x);
}

Metrics Accumulator::finish(const Field* field, int medial_patient_x) const {
  Metrics metrics = sums_;
  const double point_mm3 = pointVolume_mm3(plan_.lattice);
  metrics.removed_mm3 = static_cast<double>(metrics.removed) * point_mm3;
  metrics.removed_outside_plan_mm3 = static_cast<double>(metrics.removed_outside_plan) * point_mm3;
  metrics.time_s = seconds(first_us_, last_us_);
  if (first_cut_us_ && last_cut_us_ > *first_cut_us_) {
    metrics.mean_thrust_N = thrust_integral_at_cut_Ns_ / seconds(*first_cut_us_, last_cut_us_);
  }
  if (first_cut_us_ && deepest_ && deepest_us_ > *first_cut_us_) {
    metrics.mean_feed_mm_per_s = (deepest_->tip_mm.z - first_cut_depth_mm_) / seconds(*first_cut_us_, deepest_us_);
  }
  if (!deepest_) return metrics;
  measureHole(metrics);
  if (field == nullptr || !plan_.frame) return metrics;
  std::vector<Pose> poses = poses_;
  poses.push_back(*deepest_);
  const Breach breach = findBreach(plan_, poses, *field, medial_patient_x);
  metrics.breach_mm = breach.breach_mm;
  metrics.plunge_mm = breach.plunge_mm;
  metrics.breach_direction = breach.direction;
  return metrics;
}

}  // namespace spinaltap::metrics
