// The part of dicom_file.h that turns header elements into slices, for single images and for functional groups
// (DICOM PS3.3 C.7.6.16).
#include <algorithm>
#include <cmath>

#include "server/import/child/dicom_file.h"
#include "server/import/child/dicom_values.h"
#include "server/import/child/stack.h"

namespace spinaltap::importer {

namespace {

constexpr double kSmallestSpacing_mm = 0.01, kLargestSpacing_mm = 20;
constexpr double kFarthest_mm = 1e5;

/// Where a frame's elements are looked for: its own functional groups, the shared ones, then the data set itself.
class FrameScope {
 public:
  explicit FrameScope(const gdcm::DataSet& top) : top_(top) {}

  void addItem(const gdcm::SmartPointer<gdcm::SequenceOfItems>& groups, std::size_t index) {
    if (groups != nullptr && index < groups->GetNumberOfItems()) {
      held_.push_back(groups);
      items_.push_back(&groups->GetItem(index + 1).GetNestedDataSet());
    }
  }

  /// The data set of a macro: its sequence's first item; the top data set for an image without groups.
  [[nodiscard]] const gdcm::DataSet* macro(TagNumber sequence) {
    if (items_.empty()) return &top_;
    for (const gdcm::DataSet* item : items_) {
      const auto found = sequenceAt(*item, sequence);
      if (found == nullptr || found->GetNumberOfItems() == 0) continue;
      held_.push_back(found);
      return &found->GetItem(1).GetNestedDataSet();
    }
    return nullptr;
  }

 private:
  const gdcm::DataSet& top_;
  std::vector<gdcm::SmartPointer<gdcm::SequenceOfItems>> held_;  // items live as long as these
  std::vector<const gdcm::DataSet*> items_;
};

std::optional<std::vector<double>> numbersOf(const gdcm::DataSet* set, TagNumber tag, std::size_t count) {
  if (set == nullptr) return std::nullopt;
  auto numbers = numbersAt(*set, tag);
  if (!numbers || numbers->size() != count) return std::nullopt;
  return numbers;
}

bool isNearUnit(const Vec3& v) { return std::abs(norm(v) - 1) < 1e-3; }

Result<void> readOrientation(FrameScope& scope, Slice& slice) {
  const auto iop = numbersOf(scope.macro({0x0020, 0x9116}), {0x0020, 0x0037}, 6);
  if (!iop) return fail(ErrorCode::Corrupt, slice.name + ": ImageOrientationPatient is missing or not six numbers");
  const std::vector<double>& v = *iop;
  const Vec3 row{v[0], v[1], v[2]}, column{v[3], v[4], v[5]};
  if (!isNearUnit(row) || !isNearUnit(column) || std::abs(dot(row, column)) > kDirectionTolerance) {
    return fail(ErrorCode::Corrupt, slice.name + ": ImageOrientationPatient is not two orthogonal unit vectors");
  }
  slice.row_direction = normalized(row);
  slice.column_direction = normalized(column);
  return {};
}

Result<void> readPosition(FrameScope& scope, Slice& slice) {
  const auto ipp = numbersOf(scope.macro({0x0020, 0x9113}), {0x0020, 0x0032}, 3);
  if (!ipp) return fail(ErrorCode::Corrupt, slice.name + ": ImagePositionPatient is missing or not three numbers");
  slice.position_patient = {(*ipp)[0], (*ipp)[1], (*ipp)[2]};
  if (norm(slice.position_patient) > kFarthest_mm) {
    return fail(ErrorCode::Corrupt, slice.name + ": ImagePositionPatient is farther than 100 m away");
  }
  return {};
}

Result<void> readSpacing(FrameScope& scope, Slice& slice) {
  const gdcm::DataSet* measures = scope.macro({0x0028, 0x9110});
  const auto spacing = numbersOf(measures, {0x0028, 0x0030}, 2);
  if (!spacing) return fail(ErrorCode::Corrupt, slice.name + ": PixelSpacing is missing or not two numbers");
  for (const double mm : *spacing) {
    if (mm < kSmallestSpacing_mm || mm > kLargestSpacing_mm) {
      return fail(ErrorCode::Corrupt, slice.name + ": PixelSpacing is not between 0.01 and 20 mm");
    }
  }
  slice.row_spacing_mm = (*spacing)[0];
  slice.column_spacing_mm = (*spacing)[1];
  const auto thickness = numbersOf(measures, {0x0018, 0x0050}, 1);
  if (thickness && (*thickness)[0] >= kSmallestSpacing_mm && (*thickness)[0] <= kLargestSpacing_mm) {
    slice.thickness_mm = (*thickness)[0];
  }
  return {};
}

Result<void> readRescale(FrameScope& scope, Slice& slice) {
  const gdcm::DataSet* transformation = scope.macro({0x0028, 0x9145});
  const auto slope = numbersOf(transformation, {0x0028, 0x1053}, 1);
  const auto intercept = numbersOf(transformation, {0x0028, 0x1052}, 1);
  if (!slope || !intercept) {
    return fail(ErrorCode::Corrupt, slice.name + ": RescaleSlope or RescaleIntercept is missing or no number");
  }
  if ((*slope)[0] == 0 || std::abs((*slope)[0]) > 1e4 || std::abs((*intercept)[0]) > 1e6) {
    return fail(ErrorCode::Corrupt, slice.name + ": RescaleSlope or RescaleIntercept is impossible for HU");
  }
  const std::string type = textAt(*transformation, {0x0028, 0x1054});
  if (!type.empty() && type != "HU" && type != "US" && type != "HU_MOD") {
    return fail(ErrorCode::Unsupported, slice.name + ": its values are not HU (RescaleType)");
  }
  slice.pixels.slope = (*slope)[0];
  slice.pixels.intercept = (*intercept)[0];
  return {};
}

/// 0028,0120 and 0028,0121 have the sign of the pixels.
std::optional<int> paddingAt(const gdcm::DataSet& set, TagNumber tag, bool is_signed) {
  const auto word = wordAt(set, tag);
  if (!word) return std::nullopt;
  return is_signed ? static_cast<std::int16_t>(*word) : static_cast<int>(*word);
}

Result<void> checkGrey(const gdcm::DataSet& set, const std::string& name) {
  if (wordAt(set, {0x0028, 0x0002}).value_or(0) != 1) {
    return fail(ErrorCode::Unsupported, name + ": a colour image (SamplesPerPixel is not 1)");
  }
  const std::string photometric = textAt(set, {0x0028, 0x0004});
  if (photometric == "MONOCHROME1") {
    return fail(ErrorCode::Unsupported, name + ": MONOCHROME1 (white is low) is no CT value scale");
  }
  if (photometric != "MONOCHROME2") {
    return fail(ErrorCode::Unsupported, name + ": a colour image (PhotometricInterpretation is not MONOCHROME2)");
  }
  return {};
}

Result<StoredPixels> readPixelModule(const gdcm::DataSet& set, const std::string& name) {
  if (auto grey = checkGrey(set, name); !grey) return tl::unexpected(grey.error());
  StoredPixels pixels;
  pixels.rows = wordAt(set, {0x0028, 0x0010}).value_or(0);
  pixels.columns = wordAt(set, {0x0028, 0x0011}).value_or(0);
  if (pixels.rows == 0 || pixels.columns == 0) {
    return fail(ErrorCode::Corrupt, name + ": Rows or Columns is missing or zero");
  }
  pixels.bits_allocated = wordAt(set, {0x0028, 0x0100}).value_or(0);
  pixels.bits_stored = wordAt(set, {0x0028, 0x0101}).value_or(0);
  const int high_bit = wordAt(set, {0x0028, 0x0102}).value_or(0);
  if (pixels.bits_allocated != 8 && pixels.bits_allocated != 16) {
    return fail(ErrorCode::Unsupported,
                name + ": BitsAllocated is " + std::to_string(pixels.bits_allocated) + ", CT has 16 (or 8)");
  }
  if (pixels.bits_stored < 1 || pixels.bits_stored > pixels.bits_allocated || high_bit != pixels.bits_stored - 1) {
    return fail(ErrorCode::Corrupt, name + ": BitsStored and HighBit contradict each other");
  }
  const auto representation = wordAt(set, {0x0028, 0x0103});
  if (!representation || *representation > 1) {
    return fail(ErrorCode::Corrupt, name + ": PixelRepresentation is missing or impossible");
  }
  pixels.is_signed = *representation == 1;
  pixels.padding = paddingAt(set, {0x0028, 0x0120}, pixels.is_signed);
  pixels.padding_limit = paddingAt(set, {0x0028, 0x0121}, pixels.is_signed);
  return pixels;
}

/// Text values of ImageType are compared, never shown.
Result<void> checkUsable(const gdcm::DataSet& set, const Identity& identity) {
  const std::string& name = identity.name;
  if (textAt(set, {0x0008, 0x0008}).find("LOCALIZER") != std::string::npos) {
    return fail(ErrorCode::Unsupported, name + ": a localizer, not a slice of a volume");
  }
  if (textAt(set, {0x0028, 0x0301}) == "YES") {
    return fail(ErrorCode::Unsupported, name + ": BurnedInAnnotation: its pixels may name the patient");
  }
  if (!identity.has_pixels) return fail(ErrorCode::Corrupt, name + ": no pixel data");
  return {};
}

Result<std::size_t> frameCount(const gdcm::DataSet& set, const ParsedHeader& header, const StoredPixels& pixels,
                               std::uint64_t voxel_limit) {
  const std::string& name = header.identity.name;
  double frames = 1;
  if (has(set, {0x0028, 0x0008})) {
    const auto stated = numbersOf(&set, {0x0028, 0x0008}, 1);
    if (!stated || (*stated)[0] < 1 || (*stated)[0] != std::floor((*stated)[0])) {
      return fail(ErrorCode::Corrupt, name + ": NumberOfFrames is not a positive number");
    }
    frames = (*stated)[0];
  }
  if (frames * pixels.rows * pixels.columns > static_cast<double>(voxel_limit)) {
    return fail(ErrorCode::Limit, name + ": " + std::to_string(pixels.columns) + " x " + std::to_string(pixels.rows) +
                                      " pixels, " + std::to_string(static_cast<long long>(std::min(frames, 1e15))) +
                                      " frames: over the limit");
  }
  if (frames > 1 && header.identity.kind != ObjectKind::MultiFrameCt) {
    return fail(ErrorCode::Unsupported, name + ": several frames without the geometry of each");
  }
  return static_cast<std::size_t>(frames);
}

Result<void> readGeometry(FrameScope& scope, Slice& slice) {
  if (auto good = readSpacing(scope, slice); !good) return good;
  if (auto good = readOrientation(scope, slice); !good) return good;
  if (auto good = readPosition(scope, slice); !good) return good;
  return readRescale(scope, slice);
}

}  // namespace

Result<std::vector<Slice>> slicesOf(const ParsedHeader& header, std::uint64_t voxel_limit) {
  const gdcm::DataSet& set = header.file->GetDataSet();
  const std::string& name = header.identity.name;
  if (auto usable = checkUsable(set, header.identity); !usable) return tl::unexpected(usable.error());
  const auto pixels = readPixelModule(set, name);
  if (!pixels) return tl::unexpected(pixels.error());
  const auto frames = frameCount(set, header, *pixels, voxel_limit);
  if (!frames) return tl::unexpected(frames.error());

  const bool grouped = header.identity.kind == ObjectKind::MultiFrameCt;
  const auto shared = sequenceAt(set, {0x5200, 0x9229});
  const auto per_frame = sequenceAt(set, {0x5200, 0x9230});
  if (grouped && (per_frame == nullptr || per_frame->GetNumberOfItems() != *frames)) {
    return fail(ErrorCode::Corrupt,
                name + ": its functional groups do not match its " + std::to_string(*frames) + " frames");
  }
  std::vector<Slice> slices;
  for (std::size_t f = 0; f < *frames; ++f) {
    Slice slice;
    slice.file = header.identity.file;
    slice.frame = static_cast<int>(f);
    slice.name = *frames == 1 ? name : name + " frame " + std::to_string(f + 1);
    slice.pixels = *pixels;
    slice.frame_of_reference = textAt(set, {0x0020, 0x0052});
    slice.sop_instance = textAt(set, {0x0008, 0x0018});
    FrameScope scope(set);
    if (grouped) {
      scope.addItem(per_frame, f);
      scope.addItem(shared, 0);
    }
    if (auto good = readGeometry(scope, slice); !good) return tl::unexpected(good.error());
    slices.push_back(std::move(slice));
  }
  return slices;
}

}  // namespace spinaltap::importer
