// server/import/child/slice.h - what one image of a stack says of itself. Nothing here names a person.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/vec3.h"

namespace spinaltap::importer {

/// How stored values become HU: DICOM PS3.3 C.7.6.3 (cells), C.7.5.1.1.2 (padding), C.11.1 (rescale).
struct StoredPixels {
  int rows = 0, columns = 0;
  int bits_allocated = 0, bits_stored = 0;
  bool is_signed = false;
  double slope = 1, intercept = 0;
  std::optional<int> padding;        ///< stored value outside the field of view
  std::optional<int> padding_limit;  ///< the other end of a range of them
};

/// One frame in the patient's space: DICOM PS3.3 C.7.6.2.
struct Slice {
  std::size_t file = 0;  ///< index of its file
  int frame = 0;
  std::string name;  ///< base name, with the frame number where there are several
  StoredPixels pixels;
  double row_spacing_mm = 0;     ///< between rows: along column_direction
  double column_spacing_mm = 0;  ///< between columns: along row_direction
  std::optional<double> thickness_mm;
  Vec3 position_patient;                 ///< centre of the first pixel
  Vec3 row_direction, column_direction;  ///< unit, orthogonal
  std::string frame_of_reference, sop_instance;
};

}  // namespace spinaltap::importer
