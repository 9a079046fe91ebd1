// core/base/box.h - an axis-aligned box, in whatever frame its points are.
#pragma once
#include <algorithm>
#include <span>

#include "core/base/vec3.h"

namespace spinaltap {

struct Box {
  Vec3 low, high;

  void add(const Vec3& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  [[nodiscard]] Box widened(double margin) const {
    const Vec3 by{margin, margin, margin};
    return {low - by, high + by};
  }
};

/// The smallest around all of them. @pre not empty.
[[nodiscard]] inline Box boxAround(std::span<const Vec3> points) {
  Box box{points.front(), points.front()};
  for (const Vec3& p : points) box.add(p);
  return box;
}

}  // namespace spinaltap
