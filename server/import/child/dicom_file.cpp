#include "server/import/child/dicom_file.h"

#include <gdcmImage.h>
#include <gdcmImageReader.h>
#include <gdcmReader.h>

#include <algorithm>
#include <array>
#include <istream>
#include <new>
#include <string_view>

#include "server/import/child/dicom_bytes.h"
#include "server/import/child/dicom_values.h"

namespace spinaltap::importer {

namespace {

/// GDCM's image reader goes on to the end of the file; what stands after the pixels is not our concern.
class PixelReader : public gdcm::ImageReader {
 public:
  bool readPixels(bool multi_frame) {
    if (!ReadUpToTag(gdcm::Tag(0x7fe0, 0x0010))) return false;
    GetImage().SetTransferSyntax(GetFile().GetHeader().GetDataSetTransferSyntax());
    return ReadImage(multi_frame ? gdcm::MediaStorage::EnhancedCTImageStorage : gdcm::MediaStorage::CTImageStorage);
  }
};

/// True when the parser is content and was given everything it asked for.
template <class Reader, class Read>
Result<bool> readGuarded(Reader& reader, const InputFile& input, const Read& read) {
  if (!beginsLikeDicom(input.bytes)) return fail(ErrorCode::Corrupt, input.name + ": not a DICOM file");
  const auto rewritten = asPart10(input.bytes, input.name);
  if (!rewritten) return tl::unexpected(rewritten.error());
  MemoryBuffer buffer(rewritten->empty() ? input.bytes : *rewritten);
  std::istream stream(&buffer);
  reader.SetStream(stream);
  bool good = false;
  try {
    good = read(reader);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception&) {
    good = false;
  }
  if (buffer.ranShort())
    return fail(ErrorCode::Corrupt, input.name + ": truncated, or a value is longer than the file");
  return good;
}

struct KnownClass {
  std::string_view uid;
  bool prefix;
  ObjectKind kind;
  const char* what;
};

/// DICOM PS3.6 table A-1.
constexpr std::array kClasses{
    KnownClass{"1.2.840.10008.5.1.4.1.1.2", false, ObjectKind::CtImage, "a CT image"},
    KnownClass{"1.2.840.10008.5.1.4.1.1.2.1", false, ObjectKind::MultiFrameCt, "an enhanced CT image"},
    KnownClass{"1.2.840.10008.5.1.4.1.1.2.2", false, ObjectKind::MultiFrameCt, "an enhanced CT image"},
    KnownClass{"1.2.840.10008.5.1.4.1.1.4", true, ObjectKind::OtherImage, "an MR image"},
    KnownClass{"1.2.840.10008.5.1.4.1.1.7", true, ObjectKind::OtherImage, "a secondary capture"},
    KnownClass{"1.2.840.10008.5.1.4.1.1.66", true, ObjectKind::NoImage, "a segmentation object"},
    KnownClass{"1.2.840.10008.5.1.4.1.1.88", true, ObjectKind::NoImage, "a structured report"},
    KnownClass{"1.2.840.10008.5.1.4.1.1.481", true, ObjectKind::NoImage, "a radiotherapy object"},
    KnownClass{"1.2.840.10008.5.1.4.1.1.11", true, ObjectKind::NoImage, "a presentation state"},
    KnownClass{"1.2.840.10008.5.1.4.1.1.128", true, ObjectKind::OtherImage, "a PET image"},
    KnownClass{"1.2.840.10008.5.1.4.1.1.6", true, ObjectKind::OtherImage, "an ultrasound image"},
    KnownClass{"1.2.840.10008.5.1.4.1.1.1", true, ObjectKind::OtherImage, "a radiograph"},
    KnownClass{"1.2.840.10008.1.3.10", false, ObjectKind::NoImage, "a DICOMDIR index"},
};

bool matches(const KnownClass& known, const std::string& uid) {
  if (!known.prefix) return uid == known.uid;
  return uid.compare(0, known.uid.size(), known.uid) == 0 &&
         (uid.size() == known.uid.size() || uid[known.uid.size()] == '.');
}

/// The class says what an object is; modality must agree, and stands in where the class is empty.
void classify(const gdcm::DataSet& set, const std::string& media_class, Identity& identity) {
  std::string uid = textAt(set, {0x0008, 0x0016});
  if (uid.empty()) uid = media_class;
  const std::string modality = textAt(set, {0x0008, 0x0060});
  const bool has_image = has(set, {0x0028, 0x0010}) || has(set, {0x7fe0, 0x0010});
  identity.kind = has_image ? ObjectKind::OtherImage : ObjectKind::NoImage;
  identity.what = has_image ? "an image of another kind" : "an object without an image";
  for (const KnownClass& known : kClasses) {
    if (!matches(known, uid)) continue;
    identity.kind = known.kind;
    identity.what = known.what;
    break;
  }
  if (uid.empty() && modality == "CT") identity.kind = ObjectKind::CtImage;
  const bool is_ct = identity.kind == ObjectKind::CtImage || identity.kind == ObjectKind::MultiFrameCt;
  if (is_ct && modality != "CT") {
    identity.kind = ObjectKind::OtherImage;
    identity.what = "an object of another modality";
  }
}

bool isLossy(const gdcm::File& file) {
  const gdcm::TransferSyntax& syntax = file.GetHeader().GetDataSetTransferSyntax();
  return syntax.IsLossy() && !syntax.IsLossless() ? true : textAt(file.GetDataSet(), {0x0028, 0x2110}) == "01";
}

Error unreadable(const InputFile& input, const gdcm::File& file) {
  const std::string syntax = textAt(file.GetHeader(), {0x0002, 0x0010});
  if (!syntax.empty() && gdcm::TransferSyntax::GetTSType(syntax.c_str()) == gdcm::TransferSyntax::TS_END) {
    return {ErrorCode::Unsupported, input.name + ": its transfer syntax is unknown"};
  }
  return {ErrorCode::Corrupt, input.name + ": broken or truncated DICOM"};
}

std::size_t bytesOf(const StoredPixels& pixels, std::size_t frames) {
  return static_cast<std::size_t>(pixels.rows) * static_cast<std::size_t>(pixels.columns) * frames *
         static_cast<std::size_t>(pixels.bits_allocated / 8);
}

/// Only for pixels that are not compressed: there the length must be what the header says (or one byte of padding
/// more).
Result<void> checkLength(const InputFile& input, const gdcm::File& file, std::size_t expected) {
  const gdcm::Tag tag(0x7fe0, 0x0010);
  if (!file.GetDataSet().FindDataElement(tag)) return fail(ErrorCode::Corrupt, input.name + ": no pixel data");
  const gdcm::ByteValue* bytes = file.GetDataSet().GetDataElement(tag).GetByteValue();
  const std::size_t length = bytes == nullptr ? 0 : static_cast<std::size_t>(bytes->GetLength());
  if (length >= expected && length <= expected + 1) return {};
  return fail(ErrorCode::Corrupt,
              input.name + (length < expected ? ": pixel data truncated: " : ": surplus pixel data: ") +
                  std::to_string(length) + " bytes where the header says " + std::to_string(expected));
}

}  // namespace

Result<ParsedHeader> parseHeader(const InputFile& input, std::size_t index) {
  gdcm::Reader reader;
  const auto good =
      readGuarded(reader, input, [](gdcm::Reader& r) { return r.ReadUpToTag(gdcm::Tag(0x7fe0, 0x0010)); });
  if (!good) return tl::unexpected(good.error());
  if (!*good) return tl::unexpected(unreadable(input, reader.GetFile()));
  ParsedHeader header;
  header.file = &reader.GetFile();
  const gdcm::DataSet& set = header.file->GetDataSet();
  Identity& identity = header.identity;
  identity.file = index;
  identity.name = input.name;
  classify(set, textAt(header.file->GetHeader(), {0x0002, 0x0002}), identity);
  identity.series = textAt(set, {0x0020, 0x000e}) + "|" + textAt(set, {0x0008, 0x0060});
  identity.lossy = isLossy(*header.file);
  // The headers of all files are held at once; their pixels are not.
  const gdcm::Tag pixels(0x7fe0, 0x0010);
  identity.has_pixels = set.FindDataElement(pixels);
  header.file->GetDataSet().Remove(pixels);
  return header;
}

Result<std::vector<char>> decodePixels(const InputFile& input, const StoredPixels& pixels, std::size_t frames,
                                       bool multi_frame) {
  PixelReader reader;
  const auto good = readGuarded(reader, input, [&](PixelReader& r) { return r.readPixels(multi_frame); });
  if (!good) return tl::unexpected(good.error());
  if (!*good) {
    return fail(ErrorCode::Corrupt, input.name + ": its image cannot be read");
  }
  const gdcm::Image& image = reader.GetImage();
  const std::size_t expected = bytesOf(pixels, frames);
  if (!image.GetTransferSyntax().IsEncapsulated()) {
    if (auto whole = checkLength(input, reader.GetFile(), expected); !whole) return tl::unexpected(whole.error());
  }
  const bool same_shape = image.GetDimension(0) == static_cast<unsigned>(pixels.columns) &&
                          image.GetDimension(1) == static_cast<unsigned>(pixels.rows) &&
                          image.GetBufferLength() == expected;
  if (!same_shape) return fail(ErrorCode::Corrupt, input.name + ": its pixel data has another shape than its header");
  std::vector<char> cells(expected);
  if (!image.GetBuffer(cells.data())) {
    return fail(ErrorCode::Corrupt, input.name + ": its compressed pixel data is broken");
  }
  return cells;
}

}  // namespace spinaltap::importer
