// core/surface/defaults.h - the settings of a reconstruction, from label to mesh, each with its reason.
// rbf and mesh do not know them: whoever runs the stages in order passes them on (see README.md).
#pragma once
#include <algorithm>
#include <cstddef>

#include "core/base/vec3.h"

namespace spinaltap::surface {

/// Distance between boundary points. A lumbar vertebra has some 15,000 mm^2: 1 mm gives about 10,000 points, dense
/// enough for the roundings of the processes (radius 3 mm and more).
inline constexpr double kSampleSpacing_mm = 1.0;
/// Normals are those of quadrics through the points within so much.
inline constexpr double kNormalRadius_mm = 2.0;
/// Off-surface samples lie this far along the normals. Larger than the position noise, smaller than half a lamina.
inline constexpr double kOffset_mm = 1.0;
/// The fit stops when every sample is met this closely: below the half voxel (0.25 mm) that the mesh must reach.
inline constexpr double kFitTolerance_mm = 0.15;
/// Ridge on the kernel's diagonal: averages the boundary points' noise instead of following it.
inline constexpr double kSmoothing_mm = 0.2;
/// That ridge for a stack's voxels: the points' error grows with the longest side, and 0.2 is for 0.5 mm. On verse-014
/// (2 mm) it removes the specks and false tunnels that 0.2 leaves, at 0.02 mm more residual.
[[nodiscard]] inline double smoothingFor(const Vec3& voxel_mm) {
  return kSmoothing_mm * std::max(1.0, std::max({voxel_mm.x, voxel_mm.y, voxel_mm.z}) / 0.5);
}
/// A dense factorisation of 3000 takes about two seconds on one core and grows with the cube.
inline constexpr std::size_t kMaxCentres = 3000;
/// Mesh cells: near the voxel size, so that the flat facets add less than 0.05 mm on a radius of 3 mm.
inline constexpr double kCell_mm = 0.7;
/// The mesh is sought in the label's box widened by this.
inline constexpr double kMeshMargin_mm = 4.0;

}  // namespace spinaltap::surface
