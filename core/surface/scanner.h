// core/surface/scanner.h - how blurred a CT is, and how dense its cortical bone, read from the CT itself; and profiles
// of it (internal to surface).
#pragma once
#include <span>
#include <vector>

#include "core/surface/candidates.h"
#include "core/surface/shell_edge.h"
#include "core/surface/surface.h"

namespace spinaltap::surface {

/// How far a voxel reaches along a direction in the grid's own axes.
[[nodiscard]] double voxelAlong(const volume::Grid& grid, const Vec3& direction);

/// Standard deviation of the point spread along a direction, the interpolation between voxels included.
[[nodiscard]] double blurAlong(const Scanner& scanner, const Vec3& direction);

/// HU along a candidate's normal, each the mean over a small disc across it, as far as the query asks. `hu` holds them.
[[nodiscard]] Profile sampleProfile(const volume::CtVolume& ct, const Candidate& candidate, const EdgeQuery& query,
                                    std::vector<double>& hu);

/// What is asked of the CT at a candidate. In a plate, which ends within the profile's reach by the label, the half of
/// the other wall is not looked at: two thin walls with marrow between them would pass for one of solid bone.
[[nodiscard]] EdgeQuery queryAt(const SmoothLabel& label, const volume::Grid& grid, const Scanner& scanner,
                                const Candidate& candidate, const BoundaryOptions& options);

/// From some hundred profiles spread over the surface, fitted with the blur left free. Slices thicker than their
/// spacing, reconstruction kernels and the interpolation all show there, whatever the header says.
/// @cost  as much as 3,000 profiles.
[[nodiscard]] Scanner estimateScanner(const volume::CtVolume& ct, const SmoothLabel& label,
                                      std::span<const Candidate> candidates, const BoundaryOptions& options);

}  // namespace spinaltap::surface
