// server/jobs/segment_job.h - which voxels are the vertebra.
#pragma once
#include <optional>
#include <string>

#include "core/segment/isolate.h"
#include "core/segment/segment.h"
#include "server/jobs/figures.h"
#include "server/store/store.h"

namespace spinaltap::jobs {

struct SegmentJob {
  std::string case_id;
  /// One click: isolates the vertebra whose body holds it. Without it and without `grow` the imported label is kept.
  std::optional<segment::IsolateOptions> isolate;
  /// Threshold and region growing from a seed: for bone that has no vertebral body (a sacrum, a dry bone).
  std::optional<segment::GrowOptions> grow;
};

/// Figures: case_id, source ("imported" or "segmented"), actions (clicks that it took), voxels, volume_mm3, box_mm,
/// total_s; isolated, also threshold_hu, body_middle_patient, body_height_mm, neighbours.
/// @error InvalidArgument (neither a label nor a seed), and those of segment::isolate and segment::growFromSeed.
[[nodiscard]] Result<Figures> segmentCase(store::Store& store, const SegmentJob& job, const Progress& progress);

}  // namespace spinaltap::jobs
