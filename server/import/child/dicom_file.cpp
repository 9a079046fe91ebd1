#include "server/import/child/dicom_file.h"

#include <gdcmImage.h>
#include <gdcmImageReader.h>
#include <gdcmReader.h>

#include <algorithm>
#include <array>
#include <new>
#include <streambuf>
#include <string_view>

#include "server/import/child/dicom_values.h"

namespace spinaltap::importer {

namespace {

/// A stream over bytes that are already in memory: nothing has to be opened inside the sandbox, nothing is copied.
class MemoryBuffer : public std::streambuf {
 public:
  explicit MemoryBuffer(const std::string& bytes) {
    char* begin = const_cast<char*>(bytes.data());  // the get area is never written
    setg(begin, begin, begin + bytes.size());
  }

 protected:
  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override {
    const off_type size = egptr() - eback();
    const off_type base = from == std::ios_base::beg ? 0 : from == std::ios_base::cur ? gptr() - eback() : size;
    const off_type target = base + offset;
    if (target < 0 || target > size) return pos_type(off_type(-1));
    setg(eback(), eback() + target, egptr());
    return target;
  }
  pos_type seekpos(pos_type target, std::ios_base::openmode mode) override {
    return seekoff(off_type(target), std::ios_base::beg, mode);
  }
};

/// GDCM wants a Part 10 file: a bare data set gets a preamble and a header that states the encoding its first bytes
/// show.
std::string withPreamble(const std::string& bytes) {
  if (bytes.size() >= 132 && std::string_view(bytes).substr(128, 4) == "DICM") return {};
  if (!beginsLikeDicom(bytes) || bytes[0] != 8) return {};
  const auto upper = [&](std::size_t i) { return bytes[i] >= 'A' && bytes[i] <= 'Z'; };
  std::string syntax = upper(4) && upper(5) ? "1.2.840.10008.1.2.1" : "1.2.840.10008.1.2";
  if (syntax.size() % 2 != 0) syntax.push_back('\0');
  std::string out(128, '\0');
  out += "DICM";
  const auto length = static_cast<char>(8 + syntax.size());
  out += std::string("\x02\0\0\0UL\x04\0", 8) + std::string{length, 0, 0, 0};
  out += std::string("\x02\0\x10\0UI", 6) + std::string{static_cast<char>(syntax.size()), 0} + syntax;
  return out + bytes;
}

template <class Reader, class Read>
bool readGuarded(Reader& reader, const std::string& bytes, const Read& read) {
  const std::string wrapped = withPreamble(bytes);
  MemoryBuffer buffer(wrapped.empty() ? bytes : wrapped);
  std::istream stream(&buffer);
  reader.SetStream(stream);
  try {
    return read(reader);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception&) {
    return false;
  }
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
    identity.what = modality == "MR" ? "of modality MR" : "of a modality other than CT";
  }
}

bool isLossy(const gdcm::File& file) {
  const gdcm::TransferSyntax& syntax = file.GetHeader().GetDataSetTransferSyntax();
  return syntax.IsLossy() && !syntax.IsLossless() ? true : textAt(file.GetDataSet(), {0x0028, 0x2110}) == "01";
}

Error unreadable(const InputFile& input, const gdcm::File& file) {
  if (!beginsLikeDicom(input.bytes)) return {ErrorCode::Corrupt, input.name + ": not a DICOM file"};
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
  const bool good =
      readGuarded(reader, input.bytes, [](gdcm::Reader& r) { return r.ReadUpToTag(gdcm::Tag(0x7fe0, 0x0010)); });
  if (!good) return tl::unexpected(unreadable(input, reader.GetFile()));
  ParsedHeader header;
  header.file = &reader.GetFile();
  const gdcm::DataSet& set = header.file->GetDataSet();
  Identity& identity = header.identity;
  identity.file = index;
  identity.name = input.name;
  classify(set, textAt(header.file->GetHeader(), {0x0002, 0x0002}), identity);
  identity.series = textAt(set, {0x0020, 0x000e}) + "|" + textAt(set, {0x0008, 0x0060});
  identity.lossy = isLossy(*header.file);
  return header;
}

Result<std::vector<char>> decodePixels(const InputFile& input, const StoredPixels& pixels, std::size_t frames) {
  gdcm::ImageReader reader;
  if (!readGuarded(reader, input.bytes, [](gdcm::ImageReader& r) { return r.Read(); })) {
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
