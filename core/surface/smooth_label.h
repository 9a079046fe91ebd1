// core/surface/smooth_label.h - a label as a smooth function of place (internal to surface).
#pragma once
#include <vector>

#include "core/volume/grid.h"

namespace spinaltap::surface {

/// The label blurred by a Gaussian, in the grid's own axes: place = voxel coordinate * spacing, mm. 1 deep inside, 0
/// far outside, one half near the boundary. What lies outside the grid counts as outside the label.
class SmoothLabel {
 public:
  explicit SmoothLabel(const volume::LabelVolume& label);

  [[nodiscard]] double value(const Vec3& place_mm) const;
  [[nodiscard]] Vec3 gradient(const Vec3& place_mm) const;
  /// The block that holds every place where the value differs from 0.
  [[nodiscard]] Vec3 low() const { return padded_.toPatient({0, 0, 0}); }
  [[nodiscard]] Vec3 high() const;

 private:
  volume::Grid padded_;  ///< axis-aligned, "patient" = the grid's own axes
  std::vector<float> values_;
};

}  // namespace spinaltap::surface
