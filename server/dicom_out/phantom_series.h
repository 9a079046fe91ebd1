// server/dicom_out/phantom_series.h - the phantom as a folder of DICOM files with its ground truth beside them.
// This is all that `spinaltap phantom --out DIR [--osteoporotic] [--seed N]` needs.
#pragma once
#include <filesystem>
#include <functional>
#include <string>

#include "core/base/result.h"
#include "core/phantom/ct.h"
#include "core/phantom/phantom.h"

namespace spinaltap::dicom_out {

struct PhantomSeriesOptions {
  phantom::PhantomOptions phantom;
  phantom::CtOptions ct;  ///< its seed is the noise's; CtOptions::coarser(n) makes quick small stacks
};

/// What was written, for the command's `--json`.
struct PhantomSeriesSummary {
  volume::Grid grid;
  int slices = 0;
  Vec3 seed_point_patient;  ///< deep in cancellous bone: the seed for region growing
  phantom::Bounds bounds;
  phantom::PediclePath left, right;
  double bone_mm3 = 0;  ///< true volume, by counting voxel centres
};

/// Part done, 0 to 1.
using Progress = std::function<void(double)>;

/// Writes slice-000.dcm (towards the feet) ... and truth.json (see README.md) into `out_dir`, which is made if it is
/// missing and must otherwise be empty. All or nothing: on failure no file remains, nor a folder made here.
/// The same bytes for the same options.
/// @error  InvalidArgument (options; folder not empty), Io (with the file's name, never its whole path).
/// @cost   the time of phantom::sampleCt and 50 MB of files for the default options.
[[nodiscard]] Result<PhantomSeriesSummary> writePhantomSeries(const std::filesystem::path& out_dir,
                                                              const PhantomSeriesOptions& options,
                                                              const Progress& progress = {});

/// The text of truth.json. @pre options that sampleCt accepts.
[[nodiscard]] std::string truthJson(const PhantomSeriesOptions& options);

}  // namespace spinaltap::dicom_out
