#include <algorithm>
#include <set>
#include <string>

#include "core/segment/flood.h"
#include "core/segment/segment.h"

namespace spinaltap::segment {
namespace {

constexpr std::size_t kMostListed = 30;

std::string listOf(const std::set<std::int32_t>& values) {
  std::string text;
  std::size_t listed = 0;
  for (const std::int32_t value : values) {
    if (listed == kMostListed) return text + ", ...";
    text += (listed++ == 0 ? "" : ", ") + std::to_string(value);
  }
  return text.empty() ? "none" : text;
}

}  // namespace

Result<volume::LabelVolume> keepLabel(const volume::Grid& grid, std::span<const std::int32_t> values,
                                      std::int32_t wanted_value) {
  if (values.size() != grid.voxels()) {
    return fail(ErrorCode::InvalidArgument, "the label volume has " + std::to_string(values.size()) +
                                                " values for a grid of " + std::to_string(grid.voxels()));
  }
  volume::LabelVolume out{grid, std::vector<std::uint8_t>(values.size())};
  bool found = false;
  for (std::size_t v = 0; v < values.size(); ++v) {
    out.inside[v] = values[v] == wanted_value ? 1 : 0;
    found = found || values[v] == wanted_value;
  }
  if (found) return out;
  std::set<std::int32_t> present;
  for (const std::int32_t value : values) {
    if (present.size() > kMostListed) break;
    present.insert(value);
  }
  return fail(ErrorCode::NotFound,
              "no voxel has label " + std::to_string(wanted_value) + "; present: " + listOf(present));
}

Result<volume::LabelVolume> largestIsland(const volume::LabelVolume& label) {
  if (label.inside.size() != label.grid.voxels()) {
    return fail(ErrorCode::InvalidArgument, "label has not one value a voxel");
  }
  Mask left{label.grid.dims, label.grid.spacing_mm, label.inside};
  std::vector<std::size_t> best;
  for (std::uint8_t& value : left.set) value = value != 0 ? 1 : 0;
  for (std::size_t v = 0; v < left.set.size(); ++v) {
    if (left.set[v] == 0) continue;
    std::vector<std::size_t> part = takeConnected(left, v, left.set.size());
    if (part.size() > best.size()) best = std::move(part);
  }
  if (best.empty()) return fail(ErrorCode::NotFound, "label is empty");
  volume::LabelVolume out{label.grid, std::vector<std::uint8_t>(label.inside.size(), 0)};
  for (const std::size_t v : best) out.inside[v] = 1;
  return out;
}

}  // namespace spinaltap::segment
