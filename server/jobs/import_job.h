// server/jobs/import_job.h - a CT from DICOM or NIfTI files becomes a case.
#pragma once
#include <string>

#include "core/base/result.h"
#include "server/import/import.h"
#include "server/jobs/figures.h"
#include "server/store/store.h"

namespace spinaltap::jobs {

struct ImportJob {
  importer::ImportRequest request;
  std::string label;  ///< what the user calls the case; never taken from the files
};

/// Figures: case_id, label, source, dims, spacing_mm, voxels, hu_min, hu_max, label_voxels (with a label), notes,
/// total_s.
/// @error as importer::importVolume and store::Store::addCase.
[[nodiscard]] Result<Figures> importCase(store::Store& store, const ImportJob& job, const Progress& progress);

}  // namespace spinaltap::jobs
