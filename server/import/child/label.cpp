#include "server/import/child/label.h"

#include <array>
#include <cmath>
#include <set>

#include "server/import/child/nifti.h"
#include "server/import/child/stack.h"

namespace spinaltap::importer {

namespace {

/// CT axis a runs along label axis `axis[a]`, forwards or backwards.
struct AxisMap {
  std::array<std::size_t, 3> axis{};
  std::array<bool, 3> backwards{};
};

/// The label's voxel nearest to each corner of the CT must be the right one, and near.
Result<AxisMap> mapAxes(const NiftiHeader& label, const volume::Grid& ct, const std::string& name) {
  const std::array<Vec3, 3> directions{ct.direction.col_x, ct.direction.col_y, ct.direction.col_z};
  AxisMap map;
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = 1; b < 3; ++b) {
      const double now = std::abs(dot(directions[a], normalized(label.steps_patient[map.axis[a]])));
      if (std::abs(dot(directions[a], normalized(label.steps_patient[b]))) > now) map.axis[a] = b;
    }
    map.backwards[a] = dot(directions[a], label.steps_patient[map.axis[a]]) < 0;
  }
  const bool permutation = map.axis[0] != map.axis[1] && map.axis[1] != map.axis[2] && map.axis[0] != map.axis[2];
  bool same = permutation;
  for (std::size_t a = 0; a < 3 && same; ++a) same = label.dims[map.axis[a]] == ct.dims[a];
  if (!same) {
    return fail(ErrorCode::Unsupported, name + ": the label has other dimensions than the CT");
  }
  return map;
}

std::array<int, 3> labelVoxel(const AxisMap& map, const std::array<int, 3>& dims, int i, int j, int k) {
  const std::array<int, 3> ct{i, j, k};
  std::array<int, 3> out{};
  for (std::size_t a = 0; a < 3; ++a) out[map.axis[a]] = map.backwards[a] ? dims[map.axis[a]] - 1 - ct[a] : ct[a];
  return out;
}

/// The eight corners must coincide to a twentieth of a voxel: single-precision headers stay far below, a label shifted
/// or turned by less than a voxel does not.
Result<void> checkCorners(const NiftiHeader& label, const volume::Grid& ct, const AxisMap& map,
                          const std::string& name) {
  const double smallest = std::min({ct.spacing_mm.x, ct.spacing_mm.y, ct.spacing_mm.z});
  for (int corner = 0; corner < 8; ++corner) {
    const std::array<int, 3> c{(corner & 1) != 0 ? ct.dims[0] - 1 : 0, (corner & 2) != 0 ? ct.dims[1] - 1 : 0,
                               (corner & 4) != 0 ? ct.dims[2] - 1 : 0};
    const auto v = labelVoxel(map, label.dims, c[0], c[1], c[2]);
    const Vec3 there = label.origin_patient + label.steps_patient[0] * v[0] + label.steps_patient[1] * v[1] +
                       label.steps_patient[2] * v[2];
    const Vec3 here = ct.toPatient({static_cast<double>(c[0]), static_cast<double>(c[1]), static_cast<double>(c[2])});
    if (norm(there - here) > 0.05 * smallest) {
      return fail(ErrorCode::Unsupported, name + ": the label lies elsewhere than the CT: " +
                                              millimetres(norm(there - here)) + " mm apart at a corner");
    }
  }
  return {};
}

std::string listed(const std::set<int>& values) {
  constexpr std::size_t kShown = 40;
  std::string text;
  std::size_t shown = 0;
  for (const int value : values) {
    if (shown++ == kShown) return text + " ...";
    text += ' ';
    text += std::to_string(value);
  }
  return text.empty() ? " none" : text;
}

struct RawLabel {
  std::vector<std::uint8_t> inside;
  std::set<int> values;
};

Result<RawLabel> readInside(ByteSource& source, const NiftiHeader& header, const std::string& name, int wanted) {
  RawLabel label;
  label.inside.reserve(static_cast<std::size_t>(header.dims[0]) * static_cast<std::size_t>(header.dims[1]) *
                       static_cast<std::size_t>(header.dims[2]));
  int last = 0;
  const auto row = [&](std::span<const double> voxels) -> Result<void> {
    for (const double v : voxels) {
      if (!(std::abs(v) < 1e9) || std::abs(v - std::round(v)) > 1e-3) {
        return fail(ErrorCode::Unsupported, name + ": not a label image: its voxels are no whole numbers");
      }
      const int value = static_cast<int>(std::round(v));
      if (value != last && value != 0 && label.values.size() < 1000) label.values.insert(value);
      last = value;
      label.inside.push_back(value == wanted ? 1 : 0);
    }
    return {};
  };
  if (auto good = readNiftiRows(source, header, name, row); !good) return tl::unexpected(good.error());
  return label;
}

}  // namespace

Result<std::vector<std::uint8_t>> loadLabel(const InputFile& file, int value, const volume::Grid& ct,
                                            std::uint64_t voxel_limit) {
  if (!beginsLikeNifti(file.bytes)) return fail(ErrorCode::Unsupported, file.name + ": a label must be a NIfTI file");
  ByteSource source(file.bytes);
  const auto header = readNiftiHeader(source, file.name, voxel_limit);
  if (!header) return tl::unexpected(header.error());
  const auto map = mapAxes(*header, ct, file.name);
  if (!map) return tl::unexpected(map.error());
  if (auto same = checkCorners(*header, ct, *map, file.name); !same) return tl::unexpected(same.error());
  auto label = readInside(source, *header, file.name, value);
  if (!label) return tl::unexpected(label.error());
  if (label->values.count(value) == 0) {
    return fail(ErrorCode::NotFound, file.name + ": no voxel has the label value " + std::to_string(value) +
                                         "; values present:" + listed(label->values));
  }
  std::vector<std::uint8_t> inside(ct.voxels());
  const volume::Grid order{header->dims, {1, 1, 1}, {}, {}};
  for (int k = 0; k < ct.dims[2]; ++k) {
    for (int j = 0; j < ct.dims[1]; ++j) {
      for (int i = 0; i < ct.dims[0]; ++i) {
        const auto v = labelVoxel(*map, header->dims, i, j, k);
        inside[ct.index(i, j, k)] = label->inside[order.index(v[0], v[1], v[2])];
      }
    }
  }
  return inside;
}

}  // namespace spinaltap::importer
