// server/import/child/input_files.h - the trusted step: finds and reads files, looks at no more than their first bytes.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "server/import/import.h"

namespace spinaltap::importer {

struct InputFile {
  std::string name;   ///< base name, made safe to show
  std::string bytes;  ///< the whole file
};

enum class InputKind { Dicom, Nifti };

struct Input {
  InputKind kind = InputKind::Dicom;
  bool folder = false;
  std::vector<InputFile> files;  ///< in the order of their paths; one for Nifti
  std::vector<InputFile> label;  ///< none or one
  std::vector<std::string> notes;
  std::uint64_t total_bytes = 0;
};

/// Reads a file or, with its subfolders, a folder. Links inside a folder are not followed and only regular files are
/// opened, so that a folder from a stranger cannot point elsewhere or block. In a folder, what does not begin like
/// DICOM is skipped with a note.
/// @error NotFound, Io, Limit (number and size of files), Unsupported (nothing to import in the folder).
[[nodiscard]] Result<Input> readInput(const ImportRequest& request);

/// True for a Part 10 file, and for a bare data set that starts with group 2 or 8 in either byte order.
[[nodiscard]] bool beginsLikeDicom(std::string_view head);
[[nodiscard]] bool beginsLikeNifti(std::string_view head);

}  // namespace spinaltap::importer
