// core/phantom/ct.h - the CT stack that a scanner would make of the phantom, and the true label on any grid.
// The scanner is that of R. Schmidt, "SpinalTap" (2002): 95 slices of 512 x 512, 0.352 mm pixels, 0.5 mm apart and
// 1.1 mm thick, so that neighbours overlap and edges blur along z.
#pragma once
#include <array>
#include <cstdint>
#include <functional>

#include "core/phantom/phantom.h"
#include "core/volume/grid.h"

namespace spinaltap::phantom {

struct CtOptions {
  std::array<int, 3> dims{512, 512, 95};
  double pixel_mm = 0.352;
  double spacing_mm = 0.5;    ///< between slices
  double thickness_mm = 1.1;  ///< of a slice: the width of its box profile along z
  double psf_fwhm_mm = 0.5;   ///< in-plane point spread, full width at half maximum, close to a Gaussian
  double noise_hu = 20;       ///< standard deviation, correlated between neighbours in the plane
  std::uint64_t seed = 1;     ///< of the noise, together with the phantom's own

  /// The same field of view with `factor` times wider voxels in the plane and along z, for quick tests.
  /// @pre factor >= 1.
  [[nodiscard]] static CtOptions coarser(double factor);
};

/// Called with the part done, 0 to 1, about once a slice.
using Progress = std::function<void(double)>;

/// Axial slices along the patient's axes, k towards the head, centred so that the whole bone is in the field of view
/// (with the default extent). HU in -1024 .. 3071. The same bits for the same options on every target.
/// @error  InvalidArgument (dims not positive, lengths not positive or not finite, noise negative), Limit.
/// @cost   about 6 s on one core for the default options, 80 MB.
[[nodiscard]] Result<volume::CtVolume> sampleCt(const Phantom& phantom, const CtOptions& options = {},
                                                const Progress& progress = {});

/// Where sampleCt puts its voxels.
[[nodiscard]] volume::Grid ctGrid(const Phantom& phantom, const CtOptions& options = {});

/// 1 where the voxel's centre is inside bone.
[[nodiscard]] volume::LabelVolume truthLabel(const Phantom& phantom, const volume::Grid& grid);

}  // namespace spinaltap::phantom
