#include "core/drill/section.h"

#include <algorithm>
#include <cmath>

#include "core/drill/bounds.h"

namespace spinaltap::drill {
namespace {

constexpr double kFlat = 0.5;       // |axis.z| below this (tilted beyond 60 degrees)
constexpr double kBluntCone = 0.2;  // g below this: the cone is too blunt for the tilt, and is left to the predicate

// What lies e off the bit's surface lies at most so many e off its section: e / g in the ellipse's radius, with upright
// and k v below 1, and k v e / g in its centre.
constexpr double kPlane = 2 / kBluntCone;

}  // namespace

Sections::Sections(const BitShape& bit, const BitPose& pose, const point_volume::Lattice& lattice, double slack_mm)
    : bit_(bit), lattice_(lattice), tip_mm_(pose.tip_mm), axis_(pose.axis), touch_mm_(kMargin_mm + kPlane * slack_mm) {
  const double outermost = static_cast<double>(lattice.rings - 1) * lattice.spacing_mm;
  const double beside = std::sqrt(tip_mm_.x * tip_mm_.x + tip_mm_.y * tip_mm_.y);
  if (beside > outermost + bit.length_mm + bit.radius_mm + touch_mm_) return;
  const DiscRange reached = discsWithin(reachAlongPath(bit, pose), lattice, slack_mm);
  first_ = reached.first, last_ = reached.last;
  upright_ = std::abs(axis_.z);
  flat_ = upright_ < kFlat;
  if (flat_) return;
  per_z_ = 1.0 / axis_.z;
  shaft_outer_ = bit.radius_mm / upright_ + touch_mm_;
  lean_ = std::sqrt(axis_.x * axis_.x + axis_.y * axis_.y);
  // Singles have 24 bits: what is some mm away is known to a millionth of that, what is a bit's length away is, too.
  margin_mm_ = kMargin_mm + 1e-6 * (outermost + beside + bit.length_mm * (lean_ + bit.radius_per_cone));
  const double k = bit.radius_per_cone, g = upright_ * upright_ - k * k * lean_ * lean_;
  coned_ = bit.cone_mm > 0 && g >= kBluntCone;
  if (!coned_) return;
  cone_outer_ = k * upright_ / g;
  cone_inner_ = k * upright_ / std::sqrt(g);
  cone_shift_ = k * k / g;
}

double Sections::along(int disc) const { return (tip_mm_.z - lattice_.discZ_mm(disc)) * per_z_; }

Section Sections::at(int disc, About about) const {
  const double c = along(disc);
  Section section;
  const bool in_cone = about == About::Cone;
  const double per_along = in_cone ? 1.0 + cone_shift_ : 1.0;
  section.x_mm = tip_mm_.x - c * per_along * axis_.x;
  section.y_mm = tip_mm_.y - c * per_along * axis_.y;
  section.outer_mm = in_cone ? std::max(0.0, cone_outer_ * c + touch_mm_) : shaft_outer_;
  // Inside: what the other body, the tip and the end leave of the circle.
  const double apart = std::abs(c) * cone_shift_ * lean_;
  const double reach = (section.outer_mm + apart) * lean_ + touch_mm_;
  if (c + reach > bit_.length_mm) return section;
  if (coned_) {
    section.inner_mm =
        in_cone ? std::min(cone_inner_ * c, bit_.radius_mm - apart) : std::min(bit_.radius_mm, cone_inner_ * c - apart);
  } else if (c - reach > bit_.cone_mm) {
    section.inner_mm = bit_.radius_mm;
  }
  section.inner_mm -= touch_mm_;
  return section;
}

SectionLine Sections::line(int first) const {
  const auto f = [](double value) { return static_cast<float>(value); };
  SectionLine line{};
  line.along_0 = f(along(first));
  line.along_step = f(lattice_.spacing_mm * per_z_);
  line.tip_x = f(tip_mm_.x), line.tip_y = f(tip_mm_.y);
  line.shaft_x = f(axis_.x), line.shaft_y = f(axis_.y);
  line.cone_x = f((1.0 + cone_shift_) * axis_.x), line.cone_y = f((1.0 + cone_shift_) * axis_.y);
  line.shaft_radius = f(shaft_outer_ + margin_mm_);
  line.cone_slope = f(coned_ ? cone_outer_ : 0.0);
  line.cone_offset = coned_ ? f(touch_mm_ + margin_mm_) : line.shaft_radius;
  line.first_along = f(coned_ ? -2.0 * touch_mm_ : -(line.shaft_radius * lean_ + 2.0 * touch_mm_));
  return line;
}

}  // namespace spinaltap::drill
