// core/surface/neighbours.h - points sorted into cubes, for questions about what lies near (internal to surface).
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/base/vec3.h"

namespace spinaltap::surface {

/// Refers to the points it was made from: they must stay, unchanged.
class Neighbours {
 public:
  /// @pre cell_mm > 0, points finite.
  Neighbours(std::span<const Vec3> points, double cell_mm);

  /// Calls use(index) for every point within radius_mm, in a fixed order.
  template <class Use>
  void eachWithin(const Vec3& place, double radius_mm, const Use& use) const {
    const std::array<int, 3> low = cellOf(place - Vec3{radius_mm, radius_mm, radius_mm});
    const std::array<int, 3> high = cellOf(place + Vec3{radius_mm, radius_mm, radius_mm});
    for (int k = low[2]; k <= high[2]; ++k) {
      for (int j = low[1]; j <= high[1]; ++j) {
        for (int i = low[0]; i <= high[0]; ++i) {
          const std::size_t cell = cellIndex(i, j, k);
          for (std::size_t n = first_[cell]; n < first_[cell + 1]; ++n) {
            const Vec3 d = points_[order_[n]] - place;
            if (dot(d, d) <= radius_mm * radius_mm) use(order_[n]);
          }
        }
      }
    }
  }

 private:
  [[nodiscard]] std::array<int, 3> cellOf(const Vec3& place) const;
  [[nodiscard]] std::size_t cellIndex(int i, int j, int k) const;

  std::span<const Vec3> points_;
  Vec3 low_;
  double cell_mm_;
  std::array<int, 3> dims_{1, 1, 1};
  std::vector<std::size_t> first_;  ///< #cells + 1: where each cell's points begin in order_
  std::vector<std::size_t> order_;  ///< #points
};

}  // namespace spinaltap::surface
