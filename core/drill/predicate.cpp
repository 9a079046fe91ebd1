#include "core/drill/predicate.h"

namespace spinaltap::drill {

BitShape shapeOf(const plan::Bit& bit) {
  BitShape shape{};
  shape.radius_mm = bit.diameter_mm / 2;
  // A cone shorter than the touch is a flat end: radius / cone would overflow.
  shape.cone_mm = bit.cone_length_mm < kTouch_mm ? 0.0 : bit.cone_length_mm;
  shape.length_mm = bit.length_mm;
  shape.radius_squared = (shape.radius_mm + kTouch_mm) * (shape.radius_mm + kTouch_mm);
  shape.radius_per_cone = shape.cone_mm > 0 ? shape.radius_mm / shape.cone_mm : 0.0;
  return shape;
}

}  // namespace spinaltap::drill
