// server/jobs/plan_job.h - a path into a reconstructed case, and the points of bone around it.
#pragma once
#include <string>

#include "core/plan/path.h"
#include "server/jobs/figures.h"
#include "server/store/store.h"

namespace spinaltap::jobs {

/// Bone that leans over the entry point belongs to the volume too: it begins this far before it.
inline constexpr double kLead_mm = 4;
/// More points than this are refused: 32 million take some 70 MB and ten seconds.
inline constexpr std::uint64_t kMostPoints = 32'000'000;

struct PlanJob {
  std::string case_id, label;
  plan::Path path;
  std::string path_id = {};  ///< of the path whose place it takes, see store::Store::replacePath; empty: a new one
};

/// @error NotFound (no such case or path, not reconstructed), Limit (kMostPoints), Degenerate (no bone along the
///        path), and those of plan::checkPath.
[[nodiscard]] Result<store::Path> planPath(store::Store& store, const PlanJob& job, const Progress& progress);

/// What the contract calls a Path: id, label, entry_patient, target_patient, bit, volume_radius_mm, lead_mm,
/// spacing_mm, length_mm, frame, lattice, points, points_alive, retired, replaced_by.
[[nodiscard]] Figures describe(const store::Path& path);

}  // namespace spinaltap::jobs
