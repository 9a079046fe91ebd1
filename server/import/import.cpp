#include "server/import/import.h"

namespace spinaltap::importer {

const char* nameOf(SourceKind kind) {
  switch (kind) {
    case SourceKind::DicomSlices:
      return "dicom-slices";
    case SourceKind::DicomMultiFrame:
      return "dicom-multi-frame";
    case SourceKind::Nifti:
      return "nifti";
  }
  return "unknown";
}

Result<ImportedVolume> importVolume(const ImportRequest&, const ProgressCallback&) {
  return fail(ErrorCode::Unsupported, "the importer is not built yet");
}

}  // namespace spinaltap::importer
