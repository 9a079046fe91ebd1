// core/surface/surface.h - boundary points with normals from a label and its CT, and signed-distance samples from
// those. Off-surface samples after: Carr et al., "Reconstruction and Representation of 3D Objects with Radial Basis
// Functions", SIGGRAPH 2001, section 3. The edge after: Treece et al. 2010, see shell_edge.h.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/base/result.h"
#include "core/surface/defaults.h"
#include "core/volume/grid.h"

namespace spinaltap::surface {

/// What a CT shows of the scanner that made it. In the grid's own axes.
struct Scanner {
  Vec3 blur_mm;              ///< standard deviation of the point spread along i, j, k; voxels' own width included
  double cortical_hu = 0;    ///< of solid cortical bone
  std::size_t profiles = 0;  ///< that told so; 0: nothing was to be read, and the blur is the voxels' alone
};

enum class Placed : std::uint8_t {
  ByCt,          ///< where the CT's own edge is
  ByNeighbours,  ///< where that of the points around it is: here it is weak or false
  ByLabel,       ///< on the label's smoothed boundary
  ByVolume,      ///< on a face of the volume, which ends in bone there
};

struct OrientedPoints {
  std::vector<Vec3> positions_patient;  ///< #P, mm
  std::vector<Vec3> normals;            ///< #P unit, out of the bone
  std::vector<Placed> placed;           ///< #P
  std::size_t from_ct = 0;              ///< how many were placed ByCt
  Scanner scanner;
};

struct BoundaryOptions {
  double spacing_mm = kSampleSpacing_mm;  ///< no two points of one wall are closer than about this
  /// The CT's edge is sought this many voxels (measured along the normal) either side of the label's smoothed boundary.
  double reach_voxels = 1.5;
  /// A weaker edge than this is not trusted (facet joints, discs): the label's boundary is kept there.
  double minimum_contrast_hu = 100;
};

/// progress(fraction 0..1); may be empty.
using Progress = std::function<void(double)>;

/// Points at sub-voxel positions on the label's boundary, moved along the normal to where the CT shows the cortex to
/// end, with normals from the points around. Works in the grid's own axes, so oblique and anisotropic stacks are fine,
/// and reads the blur from the CT, so that slices may be thicker than their spacing. Where the volume ends in bone the
/// surface is closed by the outermost voxels' outer faces.
/// @error InvalidArgument (grids differ, options out of range), NotFound (empty label), Degenerate (fewer than 4
/// points).
/// @cost  linear in the voxels of the label's box and in the points. The bits do not depend on the threads.
[[nodiscard]] Result<OrientedPoints> findBoundary(const volume::CtVolume& ct, const volume::LabelVolume& label,
                                                  const BoundaryOptions& options = {}, const Progress& progress = {});

/// Field for field what rbf::Samples is (surface does not know of rbf).
struct SignedSamples {
  std::vector<Vec3> positions;       ///< #S, mm, patient frame
  std::vector<double> distances_mm;  ///< #S, negative inside bone
};

/// Every point at distance 0, then one before and one behind it along its normal, offset_mm away or as far as its
/// nearest boundary point is still its own by a margin: 0.8 of the largest ball that touches the surface there and
/// holds no other point. What leaves less than a tenth of the offset is dropped;
/// a point whose normal is zero has none.
/// @error InvalidArgument (offset not positive, sizes differ), Degenerate (no points), NotFinite.
[[nodiscard]] Result<SignedSamples> makeSamples(const OrientedPoints& points, double offset_mm = kOffset_mm);

}  // namespace spinaltap::surface
