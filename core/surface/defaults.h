// core/surface/defaults.h - the settings of a reconstruction, from label to mesh, each with its reason.
// rbf and mesh do not know them: whoever runs the stages in order passes them on (see README.md).
#pragma once
#include <algorithm>

#include "core/base/vec3.h"

namespace spinaltap::surface {

/// Distance between boundary points where voxels are fine: 0.75 mm gives a lumbar vertebra's 15,000 mm^2 some 14,700
/// points, 44,000 samples. Closer ones share the CT's voxels and noise and say no more.
inline constexpr double kSampleSpacing_mm = 0.75, kWidestSampleSpacing_mm = 1.0;
/// For a stack: half the longest side of its voxels, within those two.
[[nodiscard]] inline double sampleSpacingFor(const Vec3& voxel_mm) {
  return std::clamp(0.5 * std::max({voxel_mm.x, voxel_mm.y, voxel_mm.z}), kSampleSpacing_mm, kWidestSampleSpacing_mm);
}
/// Normals are those of quadrics through the points within so much.
inline constexpr double kNormalRadius_mm = 2.0;
/// Off-surface samples lie this far along the normals. Larger than the position noise, smaller than half a lamina.
inline constexpr double kOffset_mm = 1.0;
/// Centres are left out as long as the surface moves by no more than this: a fifth of the voxel that a scan can tell.
inline constexpr double kFitTolerance_mm = 0.05;
/// Fast sums may differ by this from direct ones: far below anything else.
inline constexpr double kFieldTolerance_mm = 1e-3;
/// The mesh is content with less: a hundredth of its own chords' error.
inline constexpr double kMeshTolerance_mm = 5e-3;
/// Mesh cells: near the voxel size, so that the flat facets add less than 0.05 mm on a radius of 3 mm.
inline constexpr double kCell_mm = 0.7;
/// The mesh is sought in the points' box widened by this.
inline constexpr double kMeshMargin_mm = 4.0;
/// Or by this: heavy smoothing swells a bone, and beyond the last slice the report's methods do not say where it ends.
inline constexpr double kWideMeshMargin_mm = 16.0, kHeavySmoothing_mm = 1.0;

}  // namespace spinaltap::surface
