// core/segment/outline.h - the closed wall of a body round its axis (internal to segment).
#pragma once
#include "core/segment/body.h"

namespace spinaltap::segment {

struct Ellipse {
  double half_width, half_depth;  ///< mm, along x and y of the body's frame
};

/// Fills outline_mm, level_mm, half_width_mm, back_mm, soft_hu and wall_hu of a body with a frame and a height: the
/// closed path round the axis across which the HU, averaged over the heights below the pedicles, drop most; by dynamic
/// programming.
/// @param near  the path stays within 30 % of it.
void traceOutline(const Scene& scene, const Ellipse& near, Body& body);

}  // namespace spinaltap::segment
