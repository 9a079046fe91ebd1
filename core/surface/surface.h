// core/surface/surface.h - boundary points with normals from a label and its CT, and signed-distance samples from
// those. Off-surface samples after: Carr et al., "Reconstruction and Representation of 3D Objects with Radial Basis
// Functions", SIGGRAPH 2001, section 3.
#pragma once
#include <cstddef>
#include <functional>
#include <vector>

#include "core/base/result.h"
#include "core/surface/defaults.h"
#include "core/volume/grid.h"

namespace spinaltap::surface {

struct OrientedPoints {
  std::vector<Vec3> positions_patient;  ///< #P, mm
  std::vector<Vec3> normals;            ///< #P unit, out of the bone
  std::size_t from_ct = 0;              ///< how many were placed by the CT's own edge; the others by the label alone
};

struct BoundaryOptions {
  double spacing_mm = kSampleSpacing_mm;  ///< no two points are closer than about this
  /// The CT's edge is sought this many voxels (measured along the normal) either side of the label's smoothed boundary.
  double reach_voxels = 1.5;
  /// A weaker edge than this is not trusted (facet joints, discs): the label's boundary is kept there.
  double minimum_contrast_hu = 100;
};

/// progress(fraction 0..1); may be empty.
using Progress = std::function<void(double)>;

/// Points at sub-voxel positions on the label's boundary, moved along the normal to where the CT falls half-way from
/// the cortex to what surrounds it. Works in the grid's own axes, so oblique and anisotropic stacks are fine.
/// @error InvalidArgument (grids differ, options out of range), NotFound (empty label), Degenerate (fewer than 4
/// points).
/// @cost  linear in the voxels of the label's box.
[[nodiscard]] Result<OrientedPoints> findBoundary(const volume::CtVolume& ct, const volume::LabelVolume& label,
                                                  const BoundaryOptions& options = {}, const Progress& progress = {});

/// Field for field what rbf::Samples is (surface does not know of rbf).
struct SignedSamples {
  std::vector<Vec3> positions;       ///< #S, mm, patient frame
  std::vector<double> distances_mm;  ///< #S, negative inside bone
};

/// Every point at distance 0, then one at +offset and one at -offset along its normal; the offset is halved until the
/// sample's nearest boundary point is its own, and the sample dropped when that leaves less than a tenth of it.
/// @error InvalidArgument (offset not positive, sizes differ), Degenerate (no points), NotFinite.
[[nodiscard]] Result<SignedSamples> makeSamples(const OrientedPoints& points, double offset_mm = kOffset_mm);

}  // namespace spinaltap::surface
