#include "core/drill/bounds.h"

#include <algorithm>
#include <cmath>

#include "core/base/dmath.h"

namespace spinaltap::drill {
namespace {

constexpr double kNearlyFlat = 1e-3;  // |axis.z| below this: the bit lies in the disc's plane

/// Largest bit radius at or before `along`: the bit only widens from the tip.
double radiusUpTo(const BitShape& bit, double along_mm) {
  if (along_mm >= bit.cone_mm) return bit.radius_mm;
  return std::max(0.0, along_mm) * bit.radius_per_cone;
}

}  // namespace

Span reachAlongPath(const BitShape& bit, const BitPose& pose) {
  // p = tip - along * axis + w with w perpendicular to the axis and |w| <= radius, so |w.z| <= radius * |axis.xy|.
  const double lean = std::sqrt(pose.axis.x * pose.axis.x + pose.axis.y * pose.axis.y);
  const double end_mm = pose.tip_mm.z - bit.length_mm * pose.axis.z;
  const double wide_mm = bit.radius_mm * lean + kMargin_mm;
  return {std::min(pose.tip_mm.z, end_mm) - wide_mm, std::max(pose.tip_mm.z, end_mm) + wide_mm};
}

int heldFloor(double value, int limit) {
  return static_cast<int>(std::floor(std::min(std::max(value, -1.0), static_cast<double>(limit))));
}
int heldCeil(double value, int limit) {
  return static_cast<int>(std::ceil(std::min(std::max(value, 0.0), static_cast<double>(limit))));
}

DiscRange discsWithin(const Span& span, const point_volume::Lattice& lattice, double slack_mm) {
  return {heldCeil((span.low_mm - slack_mm) / lattice.spacing_mm - lattice.first_disc, lattice.discs),
          heldFloor((span.high_mm + slack_mm) / lattice.spacing_mm - lattice.first_disc, lattice.discs - 1)};
}

Circle sectionCircle(const BitShape& bit, const BitPose& pose, double z_mm) {
  // A point of the section has tip.z - z = along * axis.z - w.z. With |w.z| <= radius * lean this leaves an interval of
  // `along`; the axis over that interval, widened by the largest radius in it, holds the section.
  const double lean = std::sqrt(pose.axis.x * pose.axis.x + pose.axis.y * pose.axis.y);
  const double above_mm = pose.tip_mm.z - z_mm, wide_mm = bit.radius_mm * lean + kMargin_mm;
  double low = 0, high = bit.length_mm;
  if (std::abs(pose.axis.z) >= kNearlyFlat) {
    const double a = (above_mm - wide_mm) / pose.axis.z, b = (above_mm + wide_mm) / pose.axis.z;
    low = std::max(std::min(a, b), -kMargin_mm);
    high = std::min(std::max(a, b), bit.length_mm + kMargin_mm);
    if (low > high) return {};
  } else if (std::abs(above_mm) > wide_mm + bit.length_mm * kNearlyFlat) {
    return {};
  }
  const double middle = 0.5 * (low + high), half = 0.5 * (high - low);
  Circle circle;
  circle.x_mm = pose.tip_mm.x - middle * pose.axis.x;
  circle.y_mm = pose.tip_mm.y - middle * pose.axis.y;
  circle.radius_mm = half * lean + radiusUpTo(bit, high) + kMargin_mm;
  return circle;
}

double roughArcCos(double x) {
  const double y = std::abs(x);
  const double p = ((-0.0187293 * y + 0.0742610) * y - 0.2121144) * y + 1.5707288;
  const double acute = std::sqrt(1.0 - y) * p;
  return x >= 0 ? acute : kPi - acute;
}

PolarCircle polar(const Circle& circle) {
  PolarCircle result;
  result.distance_mm = std::sqrt(circle.x_mm * circle.x_mm + circle.y_mm * circle.y_mm);
  result.radius_mm = circle.radius_mm;
  if (result.distance_mm < kMargin_mm) {
    // No direction worth having: a concentric circle that holds it.
    result.radius_mm += result.distance_mm;
    result.distance_mm = 0;
    return result;
  }
  const double cosine = std::min(1.0, std::max(-1.0, circle.x_mm / result.distance_mm));
  result.angle_rad = circle.y_mm >= 0 ? roughArcCos(cosine) : -roughArcCos(cosine);
  return result;
}

SlotRange slotsInside(const PolarCircle& circle, int ring, double spacing_mm) {
  const int slots = point_volume::Lattice::slotsOf(ring);
  const double ring_mm = static_cast<double>(ring) * spacing_mm;
  // Cosine rule for where the ring crosses the circle. The circle's margin moves the cosine by at least
  // kMargin^2 / (2 d r) = 1e-10 / (2 d r), its rounding by at most 1e-15 (d^2 + r^2 + radius^2) / (2 d r), which is
  // less for anything within 100 mm of the path.
  const double d = circle.distance_mm;
  const double excess = d * d + ring_mm * ring_mm - circle.radius_mm * circle.radius_mm;
  const double scale = 2.0 * d * ring_mm;
  if (excess <= -scale) return {0, slots};
  const double half_rad = excess >= scale ? 0.0 : roughArcCos(excess / scale);
  const double slots_per_rad = static_cast<double>(slots) / (2.0 * kPi);
  // Both angles are rough, and may err together.
  const double wide = (half_rad + 3.0 * kAngleError_rad) * slots_per_rad;
  const double first = std::ceil(circle.angle_rad * slots_per_rad - wide);
  const double last = std::floor(circle.angle_rad * slots_per_rad + wide);
  const double count = last - first + 1.0;
  if (count >= static_cast<double>(slots)) return {0, slots};
  const int begin = static_cast<int>(first);
  return {begin < 0 ? begin + slots : begin, static_cast<int>(count)};
}

}  // namespace spinaltap::drill
