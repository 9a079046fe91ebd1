// core/surface/methods.h - three ways from a label to signed-distance samples, so that they can be compared.
// Pixel and normal are those of R. Schmidt, "SpinalTap: An Architecture For Real-Time Vertebrae Drilling Simulation"
// (2002), sections 3.3 and 3.4, read as follows. Both look at one slice (constant k) at a time and know nothing of the
// CT. A boundary pixel is one of the label with at least one of its four neighbours in the slice outside; its centre is
// an on-surface sample.
//  - Pixel: every four-neighbour of a boundary pixel that is outside is a sample at + the pixels' distance, every one
//    that is inside and no boundary pixel itself one at - that distance. A pixel met from several sides counts once,
//    with the smallest distance.
//  - Normal: a boundary pixel's normal is the normalised sum of the vectors to its neighbours outside (in mm, so that
//    oblong pixels do not turn it); where they cancel out, on plates one pixel thick, it has none. Off-surface samples
//    lie along it as makeSamples puts them.
#pragma once
#include <optional>
#include <string_view>

#include "core/surface/surface.h"

namespace spinaltap::surface {

enum class Method : std::uint8_t { Pixel, Normal, Subvoxel };

/// "pixel", "normal", "subvoxel".
[[nodiscard]] std::string_view nameOf(Method method);
[[nodiscard]] std::optional<Method> methodOf(std::string_view name);

/// How far around the points the mesh is to be sought: the usual margin, or the wide one.
[[nodiscard]] double meshMarginFor(Method method, double smoothing_mm);

/// Samples, and the boundary points that they are about (the normals of Pixel are those of Normal, zero where there is
/// none).
struct SampledSurface {
  OrientedPoints points;
  SignedSamples samples;
};

/// @param options  of Subvoxel alone: the report's methods take every pixel.
/// @error as findBoundary and makeSamples.
/// @cost  Pixel and Normal linear in the voxels of the label's box.
[[nodiscard]] Result<SampledSurface> sampleSurface(const volume::CtVolume& ct, const volume::LabelVolume& label,
                                                   Method method, const BoundaryOptions& options = {},
                                                   const Progress& progress = {});

}  // namespace spinaltap::surface
