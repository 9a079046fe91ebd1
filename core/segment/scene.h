// core/segment/scene.h - what the search for bodies looks at, and the small geometry it shares (internal to segment).
#pragma once
#include <vector>

#include "core/segment/block.h"

namespace spinaltap::segment {

/// The CT in a block, as it is and without most of its noise.
struct Scene {
  Block block;
  std::vector<float> smooth;  ///< block.hu, blurred by 1 mm
  unsigned threads = 1;
};

/// Axes with z along `up`, y as near to the patient's back as can be, x to the left. @pre up is not along y.
[[nodiscard]] inline Mat3 axesAlong(const Vec3& up) {
  const Vec3 z = normalized(up);
  const Vec3 y = normalized(Vec3{0, 1, 0} - z * z.y);
  return {cross(y, z), y, z};
}

}  // namespace spinaltap::segment
