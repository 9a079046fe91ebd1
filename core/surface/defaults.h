// core/surface/defaults.h - the settings of a reconstruction, from label to mesh, each with its reason.
// rbf and mesh do not know them: whoever runs the stages in order passes them on (see README.md).
#pragma once

namespace spinaltap::surface {

/// Distance between boundary points. A lumbar vertebra has some 15,000 mm^2: 1 mm gives about 10,000 points, dense
/// enough for the roundings of the processes (radius 3 mm and more).
inline constexpr double kSampleSpacing_mm = 1.0;
/// Normals are those of quadrics through the points within so much.
inline constexpr double kNormalRadius_mm = 2.0;
/// Off-surface samples lie this far along the normals. Larger than the position noise, smaller than half a lamina.
inline constexpr double kOffset_mm = 1.0;
/// Centres are left out as long as the surface moves by no more than this: a fifth of the voxel that a scan can tell.
inline constexpr double kFitTolerance_mm = 0.05;
/// Fast sums may differ by this from direct ones: far below anything else.
inline constexpr double kFieldTolerance_mm = 1e-3;
/// Mesh cells: near the voxel size, so that the flat facets add less than 0.05 mm on a radius of 3 mm.
inline constexpr double kCell_mm = 0.7;
/// The mesh is sought in the label's box widened by this.
inline constexpr double kMeshMargin_mm = 4.0;

}  // namespace spinaltap::surface
