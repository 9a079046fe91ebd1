// server/jobs/reconstruct_job.h - from a label to a smooth surface: boundary points, implicit function, mesh.
#pragma once
#include <optional>
#include <string>

#include "core/surface/methods.h"
#include "server/jobs/figures.h"
#include "server/store/store.h"

namespace spinaltap::jobs {

struct ReconstructJob {
  std::string case_id;
  surface::Method method = surface::Method::Subvoxel;  ///< the others are the report's, for comparison
  std::optional<double> sample_spacing_mm;             ///< default: surface::sampleSpacingFor the voxels
  double tolerance_mm = surface::kFitTolerance_mm;
  std::optional<double> smoothing_mm;  ///< default: as the samples' noise asks
  double cell_mm = surface::kCell_mm;
};

/// Figures: the keys of server/cli/README.md. Stages: load, boundary, fit, mesh, keep.
/// @error NotFound (no label yet), and those of surface, rbf and mesh.
[[nodiscard]] Result<Figures> reconstructCase(store::Store& store, const ReconstructJob& job, const Progress& progress);

}  // namespace spinaltap::jobs
