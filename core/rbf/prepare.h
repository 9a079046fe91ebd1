// core/rbf/prepare.h - samples checked, recentred and freed of duplicates (internal to rbf).
#pragma once
#include <vector>

#include "core/rbf/rbf.h"

namespace spinaltap::rbf {

struct PreparedSamples {
  Vec3 centroid_patient;          ///< the middle of the bounding box
  double span_mm = 0;             ///< the box's diagonal: the diameter of a ball that holds every sample
  std::vector<Vec3> positions;    ///< relative to the centroid
  std::vector<double> distances;  ///< mm
};

/// Samples closer than 1e-6 of the span to an earlier one are merged with it: mean position, mean value.
/// @error InvalidArgument (sizes differ), NotFinite, Degenerate (fewer than 4 points, or all in one plane).
[[nodiscard]] Result<PreparedSamples> prepare(const Samples& samples);

}  // namespace spinaltap::rbf
