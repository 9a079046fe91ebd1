// server/jobs/segment_job.h - which voxels are the vertebra.
#pragma once
#include <optional>
#include <string>

#include "core/segment/segment.h"
#include "server/jobs/figures.h"
#include "server/store/store.h"

namespace spinaltap::jobs {

struct SegmentJob {
  std::string case_id;
  /// Grows from its seed; without it the imported label is kept.
  std::optional<segment::GrowOptions> grow;
};

/// Figures: case_id, source ("imported" or "segmented"), voxels, volume_mm3, box_mm, total_s.
/// @error InvalidArgument (neither a label nor a seed), and those of segment::growFromSeed.
[[nodiscard]] Result<Figures> segmentCase(store::Store& store, const SegmentJob& job, const Progress& progress);

}  // namespace spinaltap::jobs
