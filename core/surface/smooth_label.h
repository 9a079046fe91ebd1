// core/surface/smooth_label.h - a label as a smooth function of place (internal to surface).
#pragma once
#include <vector>

#include "core/volume/grid.h"

namespace spinaltap::surface {

/// The label blurred by a Gaussian, in the grid's own axes: place = voxel coordinate * spacing, mm. 1 deep inside, 0
/// far outside, one half near the boundary. Beyond the grid the values of its outermost voxels go on: where a volume
/// ends in bone the surface runs straight up to its last voxels' faces, and is cut there (candidates.h).
class SmoothLabel {
 public:
  /// @param blur_voxels  standard deviation along each axis, at least kLeastSigma_mm unless below half a voxel.
  explicit SmoothLabel(const volume::LabelVolume& label, double blur_voxels = kBlur_voxels);

  // Half a voxel irons out the steps between voxels and leaves a plate one voxel thick standing (its middle keeps
  // 0.68). A third serves where nothing is thicker than a voxel of less than a millimetre.
  static constexpr double kBlur_voxels = 0.5, kFaintBlur_voxels = 0.33;

  [[nodiscard]] double value(const Vec3& place_mm) const;
  [[nodiscard]] Vec3 gradient(const Vec3& place_mm) const;
  /// The outer faces of the outermost voxels.
  [[nodiscard]] Vec3 low() const;
  [[nodiscard]] Vec3 high() const;

 private:
  volume::Grid grid_;  ///< axis-aligned, "patient" = the grid's own axes
  std::vector<float> values_;
};

}  // namespace spinaltap::surface
