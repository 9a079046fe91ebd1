#include "core/metrics/breach.h"

#include <algorithm>
#include <cmath>

#include "core/base/dmath.h"

namespace spinaltap::metrics {
namespace {

constexpr int kAngles = 24;
constexpr double kStation_mm = 1.0, kDeepestStation_mm = 0.25;
constexpr double kAcross = 0.70710678118654752;  // cos 45 degrees
constexpr double kNothing_mm = 0.01;
constexpr double kMarch_mm = 0.05;

struct Sample {
  Vec3 point_patient, axis_patient;
};

/// Any unit vector at right angles to a unit vector.
Vec3 perpendicular(const Vec3& axis) {
  const Vec3 other = std::abs(axis.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  return normalized(cross(axis, other));
}

/// Rings around the bit, from half way up the cone to one diameter past the entry plane.
void addRings(const Plan& plan, const Pose& pose, double spacing_mm, std::vector<Sample>& samples) {
  const Vec3 u = perpendicular(pose.axis), v = cross(pose.axis, u);
  const plan::Bit& bit = plan.bit;
  const double first = bit.cone_length_mm / 2;
  for (int i = 0; first + i * spacing_mm <= bit.length_mm; ++i) {
    const double along = first + i * spacing_mm;
    const double part = along < bit.cone_length_mm ? along / bit.cone_length_mm : 1.0;
    const Vec3 middle = pose.tip_mm - pose.axis * along;
    if (middle.z < bit.diameter_mm) break;
    for (int k = 0; k < kAngles; ++k) {
      const SinCos turn = sinCosOfTurn(k, kAngles);
      const Vec3 point = middle + (u * turn.cos + v * turn.sin) * (part * bit.diameter_mm / 2);
      samples.push_back({plan.frame->toPatient(point), plan.frame->directionToPatient(pose.axis)});
    }
  }
}

std::vector<double> valuesAt(const Field& field, std::span<const Sample> samples) {
  std::vector<Vec3> points;
  for (const Sample& s : samples) points.push_back(s.point_patient);
  std::vector<double> values(points.size());
  field.values(points, values);
  return values;
}

Vec3 gradientAt(const Field& field, const Vec3& point) {
  Vec3 gradient;
  field.gradients({&point, 1}, {&gradient, 1});
  const double length = norm(gradient);
  return length > 1e-12 ? gradient / length : Vec3{};
}

Direction directionOf(const Vec3& gradient, int medial_patient_x) {
  const double x = std::abs(gradient.x), y = std::abs(gradient.y), z = std::abs(gradient.z);
  if (x >= y && x >= z) return gradient.x * medial_patient_x > 0 ? Direction::Medial : Direction::Lateral;
  if (z >= y) return gradient.z > 0 ? Direction::Cranial : Direction::Caudal;
  return gradient.y > 0 ? Direction::Posterior : Direction::Anterior;
}

/// The samples farthest out come first; the first whose gradient runs across the bit decides.
void findSide(const Field& field, std::span<const Sample> samples, int medial_patient_x, Breach& breach) {
  const std::vector<double> values = valuesAt(field, samples);
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (values[i] > kNothing_mm) out.push_back(i);
  }
  std::sort(out.begin(), out.end(), [&](std::size_t a, std::size_t b) { return values[a] > values[b]; });
  for (const std::size_t i : out) {
    const Vec3 gradient = gradientAt(field, samples[i].point_patient);
    if (std::abs(dot(gradient, samples[i].axis_patient)) > kAcross) continue;
    breach.breach_mm = values[i];
    breach.direction = directionOf(gradient, medial_patient_x);
    return;
  }
}

/// Of all ways that the tip went out of the bone, the end of the longest; 0 when there is none.
std::size_t endOfLongestWay(std::span<const Pose> poses, std::span<const double> values) {
  std::size_t first = 0, end = 0;
  double longest = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (values[i] <= kNothing_mm) {
      first = i + 1;
    } else if (const double way = poses[i].tip_mm.z - poses[first].tip_mm.z; way > longest) {
      longest = way, end = i;
    }
  }
  return end;
}

/// Back along the bit from where the tip was to the bone that it came out of; 0 unless it came out straight ahead.
double plungeOf(const Plan& plan, const Pose& pose, const Field& field) {
  const Vec3 tip = plan.frame->toPatient(pose.tip_mm), axis = plan.frame->directionToPatient(pose.axis);
  std::vector<Sample> back;
  for (double d = 0; d <= pose.tip_mm.z; d += kMarch_mm) back.push_back({tip - axis * d, axis});
  const std::vector<double> along = valuesAt(field, back);
  const auto inside = std::find_if(along.begin(), along.end(), [](double s) { return s <= 0; });
  if (inside == along.end()) return 0;
  const auto steps = static_cast<std::size_t>(inside - along.begin());
  // What is near the tip by now, bone of the other side perhaps, says nothing of how it came out.
  return dot(gradientAt(field, back[steps].point_patient), axis) < kAcross ? 0 : kMarch_mm * static_cast<double>(steps);
}

void findPlunge(const Plan& plan, std::span<const Pose> poses, const Field& field, Breach& breach) {
  std::vector<Sample> tips;
  for (const Pose& p : poses) {
    tips.push_back({plan.frame->toPatient(p.tip_mm), plan.frame->directionToPatient(p.axis)});
  }
  const std::vector<double> values = valuesAt(field, tips);
  const std::size_t worst = static_cast<std::size_t>(std::max_element(values.begin(), values.end()) - values.begin());
  for (const std::size_t i : {worst, endOfLongestWay(poses, values), tips.size() - 1}) {
    if (values[i] <= kNothing_mm || poses[i].tip_mm.z < plan.bit.diameter_mm) continue;
    breach.plunge_mm = std::max(breach.plunge_mm, plungeOf(plan, poses[i], field));
  }
}

}  // namespace

Breach findBreach(const Plan& plan, std::span<const Pose> poses, const Field& field, int medial_patient_x) {
  Breach breach;
  if (poses.empty()) return breach;
  if (medial_patient_x == 0) medial_patient_x = plan.frame->axes.col_z.x >= 0 ? 1 : -1;
  std::vector<Sample> samples;
  for (const Pose& pose : poses) addRings(plan, pose, kStation_mm, samples);
  addRings(plan, poses.back(), kDeepestStation_mm, samples);
  if (!samples.empty()) findSide(field, samples, medial_patient_x, breach);
  findPlunge(plan, poses, field, breach);
  return breach;
}

}  // namespace spinaltap::metrics
