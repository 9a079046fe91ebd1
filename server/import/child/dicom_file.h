// server/import/child/dicom_file.h - the two looks at a DICOM file: its header, then its pixels. All of GDCM's parsing
// is behind this header. Errors name the file; no text value of the header gets into them.
#pragma once
#include <gdcmFile.h>
#include <gdcmSmartPointer.h>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "server/import/child/input_files.h"
#include "server/import/child/slice.h"

namespace spinaltap::importer {

enum class ObjectKind { CtImage, MultiFrameCt, OtherImage, NoImage };

/// What decides to which series an object belongs and whether it is wanted.
struct Identity {
  std::size_t file = 0;
  std::string name;
  ObjectKind kind = ObjectKind::NoImage;
  std::string what;    ///< "an MR image", "a structured report": from a fixed list, never from the header
  std::string series;  ///< SeriesInstanceUID and modality; kept in this process
  bool lossy = false;
  bool has_pixels = false;
};

struct ParsedHeader {
  gdcm::SmartPointer<gdcm::File> file;
  Identity identity;
};

/// Everything before the pixels. @error Corrupt, Unsupported (transfer syntax).
[[nodiscard]] Result<ParsedHeader> parseHeader(const InputFile& input, std::size_t index);

/// One slice, or one a frame. @error Unsupported or Corrupt: what is missing or impossible.
[[nodiscard]] Result<std::vector<Slice>> slicesOf(const ParsedHeader& header, std::uint64_t voxel_limit);

/// The stored cells of all frames, as the header of `first` describes them.
/// @error Corrupt: short, long or undecodable pixel data.
[[nodiscard]] Result<std::vector<char>> decodePixels(const InputFile& input, const StoredPixels& pixels,
                                                     std::size_t frames, bool multi_frame);

}  // namespace spinaltap::importer
