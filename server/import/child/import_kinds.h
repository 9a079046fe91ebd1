// server/import/child/import_kinds.h - from bytes in memory to frames on the pipe.
#pragma once
#include "core/base/result.h"
#include "server/import/child/input_files.h"
#include "server/import/child/output.h"

namespace spinaltap::importer {

/// Consumes input.files. @error what refuses the import; frames may already have been sent.
[[nodiscard]] Result<void> importDicom(Input& input, const ImportRequest& request, Output& output);
[[nodiscard]] Result<void> importNifti(const Input& input, const ImportRequest& request, Output& output);

}  // namespace spinaltap::importer
