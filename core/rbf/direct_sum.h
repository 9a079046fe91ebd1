// core/rbf/direct_sum.h - sums over all pairs, shared among threads (internal).
#pragma once
#include <span>
#include <vector>

#include "core/base/vec3.h"
#include "core/rbf/simd_sums.h"

namespace spinaltap::rbf {

/// Points as one array a coordinate, relative to an origin.
struct Coordinates {
  std::vector<double> x, y, z;

  explicit Coordinates(std::span<const Vec3> points, const Vec3& origin = {});
  [[nodiscard]] std::size_t size() const { return x.size(); }
  [[nodiscard]] PointArrays<double> part(std::size_t begin, std::size_t end) const {
    return {x.data() + begin, y.data() + begin, z.data() + begin, end - begin};
  }
  [[nodiscard]] Vec3 at(std::size_t i) const { return {x[i], y[i], z[i]}; }
};

/// out[i] = sum_j weights[j] |points[i] - points[j]| for all i: every distance is taken once and used both ways. The
/// bits do not depend on the number of threads.
[[nodiscard]] std::vector<double> distancesAmong(const Coordinates& points, std::span<const double> weights,
                                                 unsigned threads);

/// out[i] = sum_j weights[j] |points[i] - sources[j]|.
[[nodiscard]] std::vector<double> distancesFrom(const Coordinates& points, const Coordinates& sources,
                                                std::span<const double> weights, unsigned threads);

}  // namespace spinaltap::rbf
