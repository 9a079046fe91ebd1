#include "server/import/child/nifti.h"

#include <nifti/nifti1.h>
#include <nifti/nifti2.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>

#include "server/import/child/stack.h"

namespace spinaltap::importer {

namespace {

/// Fields at their offsets, in either byte order.
class Fields {
 public:
  Fields(std::span<const char> bytes, bool swapped) : bytes_(bytes), swapped_(swapped) {}
  template <class T>
  [[nodiscard]] T at(std::size_t offset) const {
    std::array<char, sizeof(T)> raw{};
    std::memcpy(raw.data(), bytes_.data() + offset, sizeof(T));
    if (swapped_) std::reverse(raw.begin(), raw.end());
    T value{};
    std::memcpy(&value, raw.data(), sizeof(T));
    return value;
  }

 private:
  std::span<const char> bytes_;
  bool swapped_;
};

/// What both versions of the header say, in wide types.
struct RawHeader {
  std::array<std::int64_t, 8> dim{};
  std::array<double, 8> pixdim{};
  int datatype = 0, bitpix = 0, qform = 0, sform = 0, units = 0;
  double slope = 0, intercept = 0, vox_offset = 0;
  std::array<double, 3> quatern{}, offset{};
  std::array<double, 12> srow{};
  std::size_t size = 0;
  bool swapped = false;
};

/// The two versions name their fields alike but keep them at other places and widths.
template <class Header, class Dim, class Real, class Code>
RawHeader fieldsOf(std::span<const char> bytes, bool swapped) {
  const Fields f(bytes, swapped);
  RawHeader raw;
  raw.size = sizeof(Header);
  raw.swapped = swapped;
  for (std::size_t i = 0; i < 8; ++i) {
    raw.dim[i] = f.at<Dim>(offsetof(Header, dim) + i * sizeof(Dim));
    raw.pixdim[i] = f.at<Real>(offsetof(Header, pixdim) + i * sizeof(Real));
  }
  raw.datatype = f.at<std::int16_t>(offsetof(Header, datatype));
  raw.bitpix = f.at<std::int16_t>(offsetof(Header, bitpix));
  raw.qform = f.at<Code>(offsetof(Header, qform_code));
  raw.sform = f.at<Code>(offsetof(Header, sform_code));
  raw.slope = f.at<Real>(offsetof(Header, scl_slope));
  raw.intercept = f.at<Real>(offsetof(Header, scl_inter));
  raw.quatern = {f.at<Real>(offsetof(Header, quatern_b)), f.at<Real>(offsetof(Header, quatern_c)),
                 f.at<Real>(offsetof(Header, quatern_d))};
  raw.offset = {f.at<Real>(offsetof(Header, qoffset_x)), f.at<Real>(offsetof(Header, qoffset_y)),
                f.at<Real>(offsetof(Header, qoffset_z))};
  const std::array rows{offsetof(Header, srow_x), offsetof(Header, srow_y), offsetof(Header, srow_z)};
  for (std::size_t r = 0; r < 3; ++r) {
    for (std::size_t c = 0; c < 4; ++c) raw.srow[4 * r + c] = f.at<Real>(rows[r] + c * sizeof(Real));
  }
  return raw;
}

Result<RawHeader> readRaw(ByteSource& source, const std::string& name) {
  const auto no = [&](const char* why) { return fail(ErrorCode::Corrupt, name + ": " + why); };
  std::vector<char> bytes(sizeof(nifti_1_header));
  if (!source.read(bytes)) return no("not a NIfTI file, or cut short in its header");
  bool swapped = false;
  auto size = Fields(bytes, false).at<std::int32_t>(0);
  if (size != 348 && size != 540) {
    swapped = true;
    size = Fields(bytes, true).at<std::int32_t>(0);
  }
  if (size == 348) {
    if (std::memcmp(bytes.data() + offsetof(nifti_1_header, magic), "n+1", 4) != 0) {
      return fail(ErrorCode::Unsupported, name + ": a header without its voxels (.hdr/.img pair); give a single .nii");
    }
    RawHeader raw = fieldsOf<nifti_1_header, std::int16_t, float, std::int16_t>(bytes, swapped);
    raw.vox_offset = Fields(bytes, swapped).at<float>(offsetof(nifti_1_header, vox_offset));
    raw.units = Fields(bytes, swapped).at<std::uint8_t>(offsetof(nifti_1_header, xyzt_units));
    return raw;
  }
  if (size != 540) return no("not a NIfTI file");
  bytes.resize(sizeof(nifti_2_header));
  if (!source.read(std::span(bytes).subspan(sizeof(nifti_1_header)))) return no("cut short in its header");
  if (std::memcmp(bytes.data() + offsetof(nifti_2_header, magic), "n+2", 4) != 0) {
    return fail(ErrorCode::Unsupported, name + ": a header without its voxels (.hdr/.img pair); give a single .nii");
  }
  RawHeader raw = fieldsOf<nifti_2_header, std::int64_t, double, std::int32_t>(bytes, swapped);
  raw.vox_offset = static_cast<double>(Fields(bytes, swapped).at<std::int64_t>(offsetof(nifti_2_header, vox_offset)));
  raw.units = Fields(bytes, swapped).at<std::int32_t>(offsetof(nifti_2_header, xyzt_units));
  return raw;
}

int bytesOfType(int datatype) {
  switch (datatype) {
    case DT_UINT8:
    case DT_INT8:
      return 1;
    case DT_INT16:
    case DT_UINT16:
      return 2;
    case DT_INT32:
    case DT_UINT32:
    case DT_FLOAT32:
      return 4;
    case DT_INT64:
    case DT_UINT64:
    case DT_FLOAT64:
      return 8;
    default:
      return 0;
  }
}

Result<void> readShape(const RawHeader& raw, const std::string& name, std::uint64_t voxel_limit, NiftiHeader& header) {
  if (raw.dim[0] < 1 || raw.dim[0] > 7)
    return fail(ErrorCode::Corrupt, name + ": its number of dimensions is impossible");
  for (std::size_t d = 4; d <= static_cast<std::size_t>(raw.dim[0]); ++d) {
    if (raw.dim[d] > 1) return fail(ErrorCode::Unsupported, name + ": more than three dimensions");
  }
  if (raw.dim[0] < 3) return fail(ErrorCode::Unsupported, name + ": fewer than three dimensions");
  double voxels = 1;
  for (std::size_t d = 0; d < 3; ++d) {
    const std::int64_t n = raw.dim[d + 1];
    if (n < 1) return fail(ErrorCode::Corrupt, name + ": a dimension is not positive");
    voxels *= static_cast<double>(n);
    header.dims[d] = static_cast<int>(std::min<std::int64_t>(n, std::numeric_limits<int>::max()));
  }
  if (voxels > static_cast<double>(voxel_limit))
    return fail(ErrorCode::Limit, name + ": its dimensions are over the limit");
  header.datatype = raw.datatype;
  const int width = bytesOfType(raw.datatype);
  if (width == 0) return fail(ErrorCode::Unsupported, name + ": its data type is no real number");
  if (raw.bitpix != 8 * width) return fail(ErrorCode::Corrupt, name + ": bitpix contradicts its data type");
  constexpr double kLongestSkip = 1e8;
  const double skip = raw.vox_offset - static_cast<double>(raw.size);
  if (!(skip >= 0 && skip <= kLongestSkip)) return fail(ErrorCode::Corrupt, name + ": vox_offset is impossible");
  header.skip = static_cast<std::uint64_t>(skip);
  return {};
}

/// Rows of srow are RAS x, y, z; quaternions per nifti1.h, method 2.
void fromSform(const RawHeader& raw, NiftiHeader& header) {
  const auto& s = raw.srow;
  for (std::size_t c = 0; c < 3; ++c) header.steps_patient[c] = {-s[c], -s[4 + c], s[8 + c]};
  header.origin_patient = {-s[3], -s[7], s[11]};
}

void fromQform(const RawHeader& raw, NiftiHeader& header) {
  const auto [b, c, d] = raw.quatern;
  const double a = std::sqrt(std::max(0.0, 1 - (b * b + c * c + d * d)));
  const Vec3 x{a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)};
  const Vec3 y{2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b)};
  const Vec3 z{2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - c * c - b * b};
  const double handedness = raw.pixdim[0] < 0 ? -1 : 1;
  const std::array ras{x * raw.pixdim[1], y * raw.pixdim[2], z * (raw.pixdim[3] * handedness)};
  for (std::size_t i = 0; i < 3; ++i) header.steps_patient[i] = {-ras[i].x, -ras[i].y, ras[i].z};
  header.origin_patient = {-raw.offset[0], -raw.offset[1], raw.offset[2]};
}

Result<double> millimetresPerUnit(int units, const std::string& name, std::vector<std::string>& notes) {
  switch (XYZT_TO_SPACE(units)) {
    case NIFTI_UNITS_MM:
      return 1.0;
    case NIFTI_UNITS_METER:
      return 1000.0;
    case NIFTI_UNITS_MICRON:
      return 0.001;
    case NIFTI_UNITS_UNKNOWN:
      notes.push_back(name + ": no unit of length given, taken as mm");
      return 1.0;
    default:
      return fail(ErrorCode::Corrupt, name + ": its unit of length is impossible");
  }
}

/// Where the last voxel lies tells two placements apart as well as anything.
Vec3 farCorner(const NiftiHeader& header) {
  Vec3 corner = header.origin_patient;
  for (std::size_t i = 0; i < 3; ++i) corner += header.steps_patient[i] * static_cast<double>(header.dims[i] - 1);
  return corner;
}

/// nifti1.h leaves the choice to the program when a file has both; a program that chose otherwise sees another volume.
void noteDisagreement(const RawHeader& raw, const std::string& name, NiftiHeader& header) {
  if (raw.qform <= 0) return;
  NiftiHeader other = header;
  fromQform(raw, other);
  const double apart =
      std::max(norm(other.origin_patient - header.origin_patient), norm(farCorner(other) - farCorner(header)));
  if (!(apart <= 0.1)) header.notes.push_back(name + ": its sform and qform disagree; the sform was used");
}

Result<void> readGeometry(const RawHeader& raw, const std::string& name, NiftiHeader& header) {
  if (raw.sform > 0) {
    fromSform(raw, header);
    noteDisagreement(raw, name, header);
  } else if (raw.qform > 0) {
    fromQform(raw, header);
  } else {
    return fail(ErrorCode::Unsupported,
                name + ": no orientation (neither sform nor qform): left and right are unknown");
  }
  const auto unit = millimetresPerUnit(raw.units, name, header.notes);
  if (!unit) return tl::unexpected(unit.error());
  header.origin_patient *= *unit;
  if (!isFinite(header.origin_patient) || norm(header.origin_patient) > 1e5) {
    return fail(ErrorCode::Corrupt, name + ": its origin is not finite or farther than 100 m away");
  }
  for (Vec3& step : header.steps_patient) {
    step *= *unit;
    if (!isFinite(step) || norm(step) < 0.01 || norm(step) > 20) {
      return fail(ErrorCode::Corrupt, name + ": its voxel size is not between 0.01 and 20 mm");
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 a = normalized(header.steps_patient[i]), b = normalized(header.steps_patient[(i + 1) % 3]);
    if (std::abs(dot(a, b)) > kDirectionTolerance) {
      return fail(ErrorCode::Unsupported, name + ": its axes are not orthogonal (a sheared volume)");
    }
  }
  return {};
}

template <class T>
void convert(std::span<const char> bytes, bool swapped, std::span<double> out) {
  const Fields fields(bytes, swapped);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<double>(fields.at<T>(i * sizeof(T)));
}

void convertRow(int datatype, std::span<const char> bytes, bool swapped, std::span<double> out) {
  switch (datatype) {
    case DT_UINT8:
      return convert<std::uint8_t>(bytes, swapped, out);
    case DT_INT8:
      return convert<std::int8_t>(bytes, swapped, out);
    case DT_INT16:
      return convert<std::int16_t>(bytes, swapped, out);
    case DT_UINT16:
      return convert<std::uint16_t>(bytes, swapped, out);
    case DT_INT32:
      return convert<std::int32_t>(bytes, swapped, out);
    case DT_UINT32:
      return convert<std::uint32_t>(bytes, swapped, out);
    case DT_FLOAT32:
      return convert<float>(bytes, swapped, out);
    case DT_INT64:
      return convert<std::int64_t>(bytes, swapped, out);
    case DT_UINT64:
      return convert<std::uint64_t>(bytes, swapped, out);
    default:
      return convert<double>(bytes, swapped, out);
  }
}

bool skipBytes(ByteSource& source, std::uint64_t count) {
  std::vector<char> sink(65536);
  while (count > 0) {
    const auto part = static_cast<std::size_t>(std::min<std::uint64_t>(count, sink.size()));
    if (!source.read(std::span(sink).first(part))) return false;
    count -= part;
  }
  return true;
}

}  // namespace

ByteSource::ByteSource(const std::string& bytes) : bytes_(bytes) {
  if (bytes.size() < 2 || bytes.compare(0, 2, "\x1f\x8b") != 0) return;
  inflater_ = std::make_unique<z_stream>();
  constexpr int kGzip = 16 + MAX_WBITS;
  if (inflateInit2(inflater_.get(), kGzip) != Z_OK) throw std::bad_alloc();
}

ByteSource::~ByteSource() {
  if (inflater_) inflateEnd(inflater_.get());
}

bool ByteSource::read(std::span<char> out) {
  if (!inflater_) {
    if (bytes_.size() - at_ < out.size()) return false;
    std::memcpy(out.data(), bytes_.data() + at_, out.size());
    at_ += out.size();
    return true;
  }
  constexpr std::size_t kPiece = std::size_t{1} << 30;  // zlib counts in 32 bits
  z_stream& z = *inflater_;
  while (!out.empty()) {
    const std::size_t in = std::min(bytes_.size() - at_, kPiece), wanted = std::min(out.size(), kPiece);
    z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes_.data() + at_));
    z.avail_in = static_cast<uInt>(in);
    z.next_out = reinterpret_cast<Bytef*>(out.data());
    z.avail_out = static_cast<uInt>(wanted);
    const int state = inflate(&z, Z_NO_FLUSH);
    const std::size_t got = wanted - z.avail_out, used = in - z.avail_in;
    at_ += used;
    out = out.subspan(got);
    if (state == Z_STREAM_END && !out.empty()) {
      if (at_ >= bytes_.size() || inflateReset(&z) != Z_OK) return false;  // gzip members may follow each other
      continue;
    }
    if (state != Z_OK && state != Z_STREAM_END) return false;
    if (got == 0 && used == 0) return false;
  }
  return true;
}

Result<NiftiHeader> readNiftiHeader(ByteSource& source, const std::string& name, std::uint64_t voxel_limit) {
  const auto raw = readRaw(source, name);
  if (!raw) return tl::unexpected(raw.error());
  NiftiHeader header;
  header.swapped = raw->swapped;
  if (auto good = readShape(*raw, name, voxel_limit, header); !good) return tl::unexpected(good.error());
  if (auto good = readGeometry(*raw, name, header); !good) return tl::unexpected(good.error());
  if (raw->slope != 0) {
    header.slope = raw->slope;
    header.intercept = raw->intercept;
  }
  // NaN here means "not set" to some writers.
  if (std::isnan(raw->slope)) header.slope = 1, header.intercept = 0;
  if (!std::isfinite(header.slope) || !std::isfinite(header.intercept)) {
    return fail(ErrorCode::Corrupt, name + ": its scaling is not finite");
  }
  return header;
}

Result<void> readNiftiRows(ByteSource& source, const NiftiHeader& header, const std::string& name,
                           const NiftiRow& row) {
  const auto too_short = [&] { return fail(ErrorCode::Corrupt, name + ": truncated or broken before its last voxel"); };
  if (!skipBytes(source, header.skip)) return too_short();
  const auto columns = static_cast<std::size_t>(header.dims[0]);
  const auto width = static_cast<std::size_t>(bytesOfType(header.datatype));
  std::vector<char> bytes(columns * width);
  std::vector<double> values(columns);
  const std::int64_t rows = static_cast<std::int64_t>(header.dims[1]) * header.dims[2];
  for (std::int64_t r = 0; r < rows; ++r) {
    if (!source.read(bytes)) return too_short();
    convertRow(header.datatype, bytes, header.swapped, values);
    for (double& value : values) value = value * header.slope + header.intercept;
    if (auto good = row(values); !good) return good;
  }
  return {};
}

NiftiGrid gridOf(const NiftiHeader& header) {
  NiftiGrid out;
  out.grid.dims = header.dims;
  Vec3 i = header.steps_patient[0];
  const Vec3 &j = header.steps_patient[1], &k = header.steps_patient[2];
  out.grid.spacing_mm = {norm(i), norm(j), norm(k)};
  out.grid.origin_patient = header.origin_patient;
  out.reversed = dot(cross(i, j), k) < 0;
  if (out.reversed) {
    out.grid.origin_patient += i * static_cast<double>(header.dims[0] - 1);
    i = -i;
  }
  const Vec3 x = normalized(i);
  const Vec3 y = normalized(j - x * dot(x, j));
  out.grid.direction = {x, y, cross(x, y)};
  return out;
}

Result<std::int16_t> voxelToHu(double value, const std::string& name) {
  if (!std::isfinite(value)) return fail(ErrorCode::Corrupt, name + ": a voxel is not a finite number");
  const double rounded = std::round(value);
  if (rounded < -32768 || rounded > 32767) {
    return fail(ErrorCode::Corrupt, name + ": a voxel's HU do not fit 16 bits");
  }
  return static_cast<std::int16_t>(rounded);
}

}  // namespace spinaltap::importer
