// core/segment/body_box.h - where a vertebral body is, roughly: six walls round a place (internal to segment).
#pragma once
#include "core/base/frame.h"
#include "core/segment/profile.h"
#include "core/segment/scene.h"

namespace spinaltap::segment {

struct BodyBox {
  Frame frame;  ///< x left, y back, z up along the body's axis; origin between the plates
  Face left, right, front, back, top, bottom;
  Vec3 top_up, bottom_up;            ///< at right angles to each plate, towards the head
  Vec3 top_through, bottom_through;  ///< a place on each plate
  double score = -1e300;             ///< HU: the sum of what the walls drop, less what is unlike a body
};

/// Tries places round `inside` and tilts of the plates against `up`; the click may be some 8 mm off the axis.
/// @cost about 4 million samples, on scene.threads threads; the same box from any number of them.
[[nodiscard]] BodyBox findBox(const Scene& scene, const Vec3& inside, const Vec3& up);

/// The same again from what was found, along its own axis: fewer places and tilts. @cost a tenth.
[[nodiscard]] BodyBox refineBox(const Scene& scene, const BodyBox& found);

}  // namespace spinaltap::segment
