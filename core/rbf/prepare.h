// core/rbf/prepare.h - samples checked, recentred, scaled and freed of duplicates (internal to rbf).
#pragma once
#include <vector>

#include "core/rbf/rbf.h"

namespace spinaltap::rbf {

struct PreparedSamples {
  Vec3 centroid_patient;          ///< the middle of the bounding box
  double scale_mm = 0;            ///< the box's diagonal, by which positions are divided
  double radius_mm = 0;           ///< of a ball around the centroid that holds every sample
  std::vector<Vec3> positions;    ///< relative to the centroid, in units of the scale
  std::vector<double> distances;  ///< mm
  std::size_t merged = 0;         ///< how many samples were averaged with another
};

/// Samples closer than 1e-4 of their usual spacing (taken as the scale over the root of their number, as on a surface)
/// to an earlier one are merged with it: mean position, mean value.
/// @error InvalidArgument (sizes differ), NotFinite, Degenerate (fewer than 4 points, or all in one plane).
[[nodiscard]] Result<PreparedSamples> prepare(const Samples& samples);

}  // namespace spinaltap::rbf
