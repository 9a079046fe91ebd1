#include "server/import/child/dicom_bytes.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <string_view>

#include "server/import/child/input_files.h"

namespace spinaltap::importer {

namespace {

constexpr std::size_t kPreamble = 132;
constexpr std::string_view kDeflated = "1.2.840.10008.1.2.1.99";
constexpr std::string_view kExplicitLittle = "1.2.840.10008.1.2.1";
constexpr std::string_view kImplicitLittle = "1.2.840.10008.1.2";

unsigned byteAt(const std::string& bytes, std::size_t i) { return static_cast<unsigned char>(bytes[i]); }

std::string element(unsigned number, const char* vr, std::string value) {
  if (value.size() % 2 != 0) value.push_back('\0');
  std::string out{2, 0, static_cast<char>(number & 0xff), static_cast<char>(number >> 8)};
  return out + vr + static_cast<char>(value.size()) + '\0' + value;
}

/// Preamble and the least of headers: media class, when known, and transfer syntax.
std::string head(std::string_view syntax, const std::string& media_class) {
  std::string group;
  if (!media_class.empty()) group += element(0x0002, "UI", media_class);
  group += element(0x0010, "UI", std::string(syntax));
  const auto size = static_cast<char>(group.size());
  return std::string(128, '\0') + "DICM" + element(0, "UL", std::string{size, 0, 0, 0}) + group;
}

/// What the file meta group says and where it ends; it is always explicit little endian.
struct Meta {
  std::string media_class, syntax;
  std::size_t end = kPreamble;
};

std::string trimmed(std::string text) {
  while (!text.empty() && (text.back() == '\0' || text.back() == ' ')) text.pop_back();
  return text;
}

Meta readMeta(const std::string& bytes) {
  Meta meta;
  while (meta.end + 8 <= bytes.size() && byteAt(bytes, meta.end) == 2 && byteAt(bytes, meta.end + 1) == 0) {
    const unsigned number = byteAt(bytes, meta.end + 2) | (byteAt(bytes, meta.end + 3) << 8);
    const std::string_view vr = std::string_view(bytes).substr(meta.end + 4, 2);
    std::size_t length = byteAt(bytes, meta.end + 6) | (byteAt(bytes, meta.end + 7) << 8);
    std::size_t value = meta.end + 8;
    if (vr == "OB" || vr == "UN") {
      if (value + 4 > bytes.size()) break;
      length = 0;
      for (std::size_t i = 4; i-- > 0;) length = (length << 8) | byteAt(bytes, value + i);
      value += 4;
    }
    if (length > bytes.size() - value) break;
    if (number == 0x0002) meta.media_class = trimmed(bytes.substr(value, std::min<std::size_t>(length, 64)));
    if (number == 0x0010) meta.syntax = trimmed(bytes.substr(value, std::min<std::size_t>(length, 64)));
    meta.end = value + length;
  }
  return meta;
}

/// A CT image is 0.5 MB and deflates to a half or a quarter; an empty one to a thousandth.
std::size_t inflateLimit(std::size_t deflated) { return (std::size_t{32} << 20) + 20 * deflated; }

Result<std::string> inflated(std::string_view bytes, const std::string& name) {
  z_stream z{};
  if (inflateInit2(&z, -MAX_WBITS) != Z_OK) return fail(ErrorCode::Limit, name + ": no memory to inflate it");
  const std::size_t limit = inflateLimit(bytes.size());
  z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  z.avail_in = static_cast<uInt>(std::min<std::size_t>(bytes.size(), std::size_t{1} << 30));
  std::string out;
  int state = Z_OK;
  while (state == Z_OK && out.size() <= limit) {
    const std::size_t before = out.size();
    out.resize(before + (std::size_t{1} << 18));
    z.next_out = reinterpret_cast<Bytef*>(out.data() + before);
    z.avail_out = static_cast<uInt>(out.size() - before);
    state = inflate(&z, Z_NO_FLUSH);
    out.resize(out.size() - z.avail_out);
    if (state == Z_OK && out.size() == before) break;  // no more input
  }
  inflateEnd(&z);
  if (out.size() > limit) return fail(ErrorCode::Limit, name + ": inflates to more than an image of its size can need");
  if (state != Z_STREAM_END) return fail(ErrorCode::Corrupt, name + ": its deflated data is truncated or broken");
  return out;
}

}  // namespace

Result<std::string> asPart10(const std::string& bytes, const std::string& name) {
  if (bytes.size() < kPreamble || bytes.compare(128, 4, "DICM") != 0) {
    if (!beginsLikeDicom(bytes) || bytes[0] != 8) return std::string();
    const auto upper = [&](std::size_t i) { return bytes[i] >= 'A' && bytes[i] <= 'Z'; };
    return head(upper(4) && upper(5) ? kExplicitLittle : kImplicitLittle, {}) + bytes;
  }
  const Meta meta = readMeta(bytes);
  if (meta.syntax != kDeflated) return std::string();
  auto data = inflated(std::string_view(bytes).substr(meta.end), name);
  if (!data) return data;
  return head(kExplicitLittle, meta.media_class) + *data;
}

MemoryBuffer::MemoryBuffer(const std::string& bytes) {
  char* begin = const_cast<char*>(bytes.data());  // the get area is never written
  setg(begin, begin, begin + bytes.size());
}

std::streamsize MemoryBuffer::xsgetn(char* out, std::streamsize count) {
  const std::streamsize left = egptr() - gptr();
  const std::streamsize got = std::min(count, left);
  // At the end of the file the parser asks for the next tag and finds nothing: only more than that is a loss.
  constexpr std::streamsize kTag = 4;
  if (got < count && (left > 0 || count > kTag)) ran_short_ = true;
  if (got > 0) std::memcpy(out, gptr(), static_cast<std::size_t>(got));
  setg(eback(), gptr() + got, egptr());
  return got;
}

MemoryBuffer::pos_type MemoryBuffer::seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) {
  const off_type size = egptr() - eback();
  const off_type base = from == std::ios_base::beg ? 0 : from == std::ios_base::cur ? gptr() - eback() : size;
  const off_type target = base + offset;
  if (target < 0 || target > size) return pos_type(off_type(-1));
  setg(eback(), eback() + target, egptr());
  return target;
}

MemoryBuffer::pos_type MemoryBuffer::seekpos(pos_type target, std::ios_base::openmode mode) {
  return seekoff(off_type(target), std::ios_base::beg, mode);
}

}  // namespace spinaltap::importer
