// core/drill/bounds.h - where on a disc the bit can possibly be. Bounds only: they choose what is put to the predicate,
// and every one of them errs towards too much. Private to core/drill and its tests.
//
// The margin. Points, tips that can touch a point, and bits lie within 1500 mm of the path frame's origin
// (checkLattice, checkBit), where doubles round by at most 2.3e-13 mm; the few operations below stay under 1e-11 mm
// before a division, and the one division by axis.z is only made where |axis.z| >= 1e-3, so under 1e-8 mm after it. The
// predicate widens the bit by kTouch_mm = 1e-9, and an axis that is a unit vector only to 1e-9 tilts a cross-section of
// a 200 mm bit by up to 4e-7 mm. kMargin_mm is above their sum twenty times over, and a thousandth of the finest
// spacing.
#pragma once
#include "core/base/vec3.h"
#include "core/drill/engine.h"
#include "core/drill/predicate.h"

namespace spinaltap::drill {

inline constexpr double kMargin_mm = 1e-5;

/// z values that the bit occupies, margin included.
struct Span {
  double low_mm, high_mm;
};
[[nodiscard]] Span reachAlongPath(const BitShape& bit, const BitPose& pose);

/// floor or ceil of a value, held inside 0 .. limit (floor: from -1) before it becomes an integer.
[[nodiscard]] int heldFloor(double value, int limit);
[[nodiscard]] int heldCeil(double value, int limit);

/// The discs of a lattice that lie in a span widened by `slack_mm`: first .. last, empty when first > last.
struct DiscRange {
  int first = 0, last = -1;
};
[[nodiscard]] DiscRange discsWithin(const Span& span, const point_volume::Lattice& lattice, double slack_mm = 0);

/// A circle that holds the bit's section with the plane z = z_mm, margin included; radius < 0 when the bit misses it.
struct Circle {
  double x_mm = 0, y_mm = 0, radius_mm = -1;
};
[[nodiscard]] Circle sectionCircle(const BitShape& bit, const BitPose& pose, double z_mm);

/// The slots of a ring that lie inside a circle: first .. first + count - 1, modulo the ring's slots.
struct SlotRange {
  int first = 0, count = 0;
};

/// A circle in polar form, so that the rings of one disc share the work.
struct PolarCircle {
  double distance_mm = 0;  ///< of its centre from the path
  double angle_rad = 0;    ///< of its centre, -pi .. pi, to kAngleError_rad
  double radius_mm = 0;
};
[[nodiscard]] PolarCircle polar(const Circle& circle);

/// @pre ring >= 1. A superset of the slots inside the circle, by less than one slot at each end.
[[nodiscard]] SlotRange slotsInside(const PolarCircle& circle, int ring, double spacing_mm);

/// arccos to within kAngleError_rad, by + * and sqrt alone. @pre -1 <= x <= 1.
/// Coefficients: Abramowitz and Stegun, Handbook of Mathematical Functions, 4.4.45 (error 6.7e-5).
[[nodiscard]] double roughArcCos(double x);
inline constexpr double kAngleError_rad = 7e-5;

}  // namespace spinaltap::drill
