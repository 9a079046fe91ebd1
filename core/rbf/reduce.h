// core/rbf/reduce.h - a surface told with fewer centres (internal).
// After: Carr et al., SIGGRAPH 2001, section 4 (greedy centre reduction).
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "core/base/result.h"
#include "core/base/vec3.h"
#include "core/rbf/system.h"

namespace spinaltap::rbf {

struct Reduced {
  std::vector<std::uint32_t> centres;  ///< indices into the points
  SystemSolution solution;             ///< over the centres
  double largest = 0;                  ///< the reduced fit minus the values, over all points
};

/// Starts with an even choice of points, and adds those it misses most, spread out, until every value is met within
/// `tolerance`. Give it smooth values: among noisy ones it picks the noise.
/// @error as System::make; NotConverged when all points are centres and the tolerance is still not met.
[[nodiscard]] Result<Reduced> reduce(std::span<const Vec3> points, std::span<const double> values, double tolerance,
                                     unsigned threads, const std::function<void(double)>& progress);

}  // namespace spinaltap::rbf
