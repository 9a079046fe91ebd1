// server/import/import.h - a CT volume from a DICOM folder or a NIfTI file.
// The calling program opens and parses nothing of the data: spinaltap-import, a child process under seccomp and
// resource limits, does. Only geometry, HU and a label come back; nothing that names a person.
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/volume/grid.h"

namespace spinaltap::importer {

/// Bounds of one import. The child refuses what will not fit before it allocates.
struct ImportLimits {
  std::chrono::milliseconds wall_time{120'000};         ///< the child is killed after that
  std::uint64_t memory_bytes = std::uint64_t{4} << 30;  ///< address space of the child
  std::uint64_t input_bytes = std::uint64_t{3} << 29;   ///< sum of the sizes of all files read (1.5 GiB)
  std::uint64_t voxels = std::uint64_t{1} << 29;        ///< 512 x 512 x 2048
  std::uint32_t files = 10'000;                         ///< files in the folder
};

/// One value of a label image on the grid of the CT.
struct LabelRequest {
  std::filesystem::path file;  ///< .nii or .nii.gz on the CT's voxels (any axis order)
  int value = 1;               ///< > 0
};

struct ImportRequest {
  std::filesystem::path from;  ///< a folder (searched with its subfolders), a multi-frame DICOM file, .nii or .nii.gz
  std::optional<LabelRequest> label;
  int series = 0;  ///< 1, 2, ... picks one of several series, numbered as in the refusal; 0: there is one
  bool allow_single_slice = false;  ///< for tests: a lone slice becomes a volume of one layer
  ImportLimits limits;
  std::filesystem::path program;  ///< the child; empty: spinaltap-import beside the running program
};

struct ImportProgress {
  std::string stage;  ///< "read", "check", "decode", "label"
  std::uint64_t done = 0;
  std::uint64_t total = 0;
};
using ProgressCallback = std::function<void(const ImportProgress&)>;

enum class SourceKind : std::uint8_t { DicomSlices, DicomMultiFrame, Nifti };
/// "dicom-slices", "dicom-multi-frame", "nifti".
[[nodiscard]] const char* nameOf(SourceKind kind);

struct ImportedVolume {
  volume::CtVolume ct;                       ///< a grid that passes volume::checkGrid
  std::optional<volume::LabelVolume> label;  ///< on the CT's grid, when one was asked for; never empty
  SourceKind source = SourceKind::DicomSlices;
  std::vector<std::string> notes;  ///< one line each: files skipped, padding masked, lossy compression, ...
};

/// Runs the child to its end. Blocks; call it from any thread. The callback runs on the calling thread.
/// @error Every refusal is one line that names the file (base name only) and what was wrong. Unsupported: not one CT
///        volume. Corrupt: broken bytes, or the child crashed on them. Limit: time, memory, size. NotFound, Io.
///        InvalidArgument: the request itself.
[[nodiscard]] Result<ImportedVolume> importVolume(const ImportRequest& request, const ProgressCallback& progress = {});

}  // namespace spinaltap::importer
