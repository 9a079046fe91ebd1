#include "server/jobs/codec.h"

#include "core/wire/body.h"
#include "core/wire/volume_message.h"
#include "server/import/grid_bytes.h"

namespace spinaltap::jobs {
namespace {

constexpr std::uint32_t kLabelMagic = 0x314c5453;  // the bytes 'S' 'T' 'L' '1'
constexpr std::uint32_t kModelMagic = 0x31465453;  // the bytes 'S' 'T' 'F' '1'
constexpr std::uint32_t kModelVersion = 2;

}  // namespace

std::vector<std::byte> encodeCt(const volume::CtVolume& ct) {
  const volume::Grid& g = ct.grid;
  return wire::encodeVolume({g.dims, g.spacing_mm, g.origin_patient, g.direction}, ct.hu);
}

Result<volume::CtVolume> decodeCt(std::span<const std::byte> bytes) {
  auto message = wire::decodeVolume(bytes);
  if (!message) return tl::unexpected(message.error());
  const wire::VolumeGrid& g = message->grid;
  volume::CtVolume ct{{g.dims, g.spacing_mm, g.origin_patient, g.direction}, std::move(message->hu)};
  if (const auto checked = volume::checkGrid(ct.grid); !checked) return tl::unexpected(checked.error());
  return ct;
}

std::vector<std::byte> encodeLabel(const volume::LabelVolume& label) {
  std::vector<std::uint32_t> runs;
  std::uint8_t value = 0;
  std::uint32_t length = 0;
  for (const std::uint8_t inside : label.inside) {
    if ((inside != 0) != (value != 0)) {
      runs.push_back(length);
      length = 0;
      value = inside != 0 ? 1 : 0;
    }
    ++length;
  }
  runs.push_back(length);
  wire::ByteWriter out;
  out.u32(kLabelMagic);
  out.u32(1);
  importer::writeGrid(out, label.grid);
  out.u32(static_cast<std::uint32_t>(runs.size()));
  for (const std::uint32_t run : runs) out.u32(run);
  return out.take();
}

Result<volume::LabelVolume> decodeLabel(std::span<const std::byte> bytes) {
  wire::ByteReader in(bytes);
  if (const auto read = wire::readPreamble(in, "label", kLabelMagic); !read) return tl::unexpected(read.error());
  volume::LabelVolume label;
  label.grid = importer::readGrid(in);
  const std::uint32_t runs = in.u32();
  if (in.failed() || in.left() != std::size_t{4} * runs) {
    return wire::corrupt("label", in.offset(), "its length does not fit");
  }
  if (const auto checked = volume::checkGrid(label.grid); !checked) return tl::unexpected(checked.error());
  std::size_t at = 0;
  label.inside.assign(label.grid.voxels(), 0);
  for (std::uint32_t run = 0; run < runs; ++run) {
    const std::size_t length = in.u32();
    if (length > label.inside.size() - at) return wire::corrupt("label", in.offset(), "more voxels than the grid has");
    std::fill_n(label.inside.begin() + static_cast<std::ptrdiff_t>(at), length, static_cast<std::uint8_t>(run & 1));
    at += length;
  }
  if (at != label.inside.size()) return wire::corrupt("label", in.offset(), "fewer voxels than the grid has");
  return label;
}

std::vector<std::byte> encodeModel(const rbf::Model& model) {
  wire::ByteWriter out;
  out.u32(kModelMagic);
  out.u32(kModelVersion);
  out.vec3(model.centroid_patient);
  out.f64(model.radius_mm);
  out.f64(model.constant);
  out.vec3(model.linear);
  out.u32(static_cast<std::uint32_t>(model.centres.size()));
  for (std::size_t i = 0; i < model.centres.size(); ++i) {
    out.vec3(model.centres[i]);
    out.f64(model.weights[i]);
  }
  return out.take();
}

Result<rbf::Model> decodeModel(std::span<const std::byte> bytes) {
  wire::ByteReader in(bytes);
  const auto version = wire::readPreamble(in, "model", kModelMagic, kModelVersion);
  if (!version) return tl::unexpected(version.error());
  rbf::Model model;
  model.centroid_patient = in.vec3();
  if (*version >= 2) model.radius_mm = in.f64();
  model.constant = in.f64();
  model.linear = in.vec3();
  const std::uint32_t centres = in.u32();
  if (in.failed() || in.left() != std::size_t{32} * centres) {
    return wire::corrupt("model", in.offset(), "its length does not fit");
  }
  for (std::uint32_t i = 0; i < centres; ++i) {
    model.centres.push_back(in.vec3());
    model.weights.push_back(in.f64());
  }
  return model;
}

double lipschitzOf(const rbf::Model& model) {
  double sum = norm(model.linear);
  for (const double weight : model.weights) sum += std::abs(weight);
  return std::max(1.0, sum * (1 + 1e-9));  // above the rounding of the sum, and the bound far away has slope 1
}

}  // namespace spinaltap::jobs
