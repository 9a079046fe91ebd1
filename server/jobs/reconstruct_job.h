// server/jobs/reconstruct_job.h - from a label to a smooth surface: boundary points, implicit function, mesh.
#pragma once
#include <optional>
#include <string>

#include "core/surface/defaults.h"
#include "server/jobs/figures.h"
#include "server/store/store.h"

namespace spinaltap::jobs {

struct ReconstructJob {
  std::string case_id;
  double sample_spacing_mm = surface::kSampleSpacing_mm;
  double tolerance_mm = surface::kFitTolerance_mm;
  std::optional<double> smoothing_mm;  ///< default: as the samples' noise asks
  double cell_mm = surface::kCell_mm;
};

/// The CT kept for the browser is the vertebra's box and this much around it.
inline constexpr double kRoiMargin_mm = 15;

/// Figures: case_id, boundary_points, boundary_points_from_ct, samples, centres, residual_max_mm, residual_rms_mm,
/// reduction_max_mm, tolerance_mm, noise_mm, smoothing_mm, sum_abs_weights, vertices, triangles, roi_dims, boundary_s,
/// fit_s, mesh_s, total_s.
/// @error NotFound (no label yet), and those of surface, rbf and mesh.
[[nodiscard]] Result<Figures> reconstructCase(store::Store& store, const ReconstructJob& job, const Progress& progress);

}  // namespace spinaltap::jobs
