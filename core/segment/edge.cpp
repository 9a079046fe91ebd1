#include "core/segment/edge.h"

#include <algorithm>
#include <cmath>

#include "core/base/parallel.h"
#include "core/segment/distance.h"
#include "core/segment/filter.h"
#include "core/segment/flood.h"
#include "core/volume/crop.h"

namespace spinaltap::segment {
namespace {

using volume::CtVolume;
using volume::Grid;
using volume::LabelVolume;
using volume::VoxelBox;

constexpr double kClosing_mm = 1.5;  // gaps in the shell up to twice this are bridged; foramina and canal are wider
constexpr double kInner_mm = 1.5;    // that deep in the coarse result the CT has no say: marrow may be dark
constexpr double kDenoise_mm = 0.45, kDenoise_voxels = 0.45;
constexpr double kSoft_hu = 40, kLeastBone_hu = 300, kMostBone_hu = 900;
constexpr double kLocal = 0.25;  // part of the threshold that follows the brightest bone near by
constexpr double kBrightest_mm = 2;
constexpr double kRough_mm = 0.7, kRough_voxels = 0.6;  // the outline is smoothed over about this, the larger

double axisOf(const Vec3& v, std::size_t a) { return a == 0 ? v.x : a == 1 ? v.y : v.z; }

/// In front of the canal a vertebra is its body with its rims and spurs. What the flood took beyond (a vessel that
/// touches it, calcium in a disc) is not bone of it.
/// @param plate_mm  how far a dished plate may lie beyond the plane that was laid through it.
bool nearBody(const Body& body, const Vec3& local, double plate_mm) {
  constexpr double kSpur_mm = 8, kRim_mm = 5;
  if (local.y > body.back_mm - 2) return true;
  if (local.y > 0 && std::abs(local.x) > 0.8 * body.half_width_mm && std::abs(local.z) < 0.5 * body.height_mm)
    return true;
  const ColumnDepth depth = depthIn(body, local);
  return depth.of_wall > -kSpur_mm && depth.of_plates > (depth.of_wall > kRim_mm ? -plate_mm : -kSpur_mm);
}

/// A dish of 1.5 mm, and the half voxel by which the CT's own sampling blurs it along the body's axis.
double plateSlack(const EdgeInput& in) {
  const Vec3 up = transposeTimes(in.ct.grid.direction, in.spine.wanted.frame.axes.col_z), s = in.ct.grid.spacing_mm;
  return 1.5 + 0.5 * (std::abs(up.x) * s.x + std::abs(up.y) * s.y + std::abs(up.z) * s.z);
}

void closeAndFill(Mask& mask) {
  Mask closed = dilated(mask, kClosing_mm);
  fillHoles(closed);
  closed = eroded(closed, kClosing_mm);
  for (std::size_t v = 0; v < mask.set.size(); ++v) mask.set[v] |= closed.set[v];
  fillHoles(mask);
}

void keepLargest(Mask& mask) {
  std::vector<std::size_t> best;
  for (std::size_t v = 0; v < mask.set.size(); ++v) {
    if (mask.set[v] == 0) continue;
    std::vector<std::size_t> part = takeConnected(mask, v, mask.set.size());
    if (part.size() > best.size()) best = std::move(part);
  }
  for (const std::size_t v : best) mask.set[v] = 1;
}

/// A box of the block's voxels: the block itself, without values, cut to where the wanted vertebra's may be.
Block partOwned(const EdgeInput& in) {
  constexpr int kMargin = 5;  // more than the closing reaches, so that all round it lies open
  const Block& block = in.scene.block;
  std::array<int, 3> low = block.dims, high{-1, -1, -1};
  std::size_t v = 0;
  for (int k = 0; k < block.dims[2]; ++k) {
    for (int j = 0; j < block.dims[1]; ++j) {
      for (int i = 0; i < block.dims[0]; ++i, ++v) {
        if (in.ownership.owner[v] != kWanted) continue;
        const std::array<int, 3> at{i, j, k};
        for (std::size_t a = 0; a < 3; ++a) low[a] = std::min(low[a], at[a]), high[a] = std::max(high[a], at[a]);
      }
    }
  }
  Block part;
  part.step_mm = block.step_mm;
  for (std::size_t a = 0; a < 3; ++a) {
    low[a] = std::max(0, low[a] - kMargin);
    part.dims[a] = std::max(0, std::min(block.dims[a] - 1, high[a] + kMargin) - low[a] + 1);
  }
  part.low_mm = block.place(low[0], low[1], low[2]);
  return part;
}

/// Beyond the facets a vertebra is its two transverse processes: bars without an opening to keep, with a cortex so thin
/// that many a voxel does not show it and marrow as dark as muscle. So wider gaps are bridged there than elsewhere.
void closeProcesses(const Body& body, const Block& part, Mask& mask) {
  constexpr double kGap_mm = 4;    // half a gap, about half the height of a process
  constexpr double kAside = 1.3;   // half widths of the body
  constexpr double kHeight = 0.6;  // of the body's, to each side of its middle
  const Mask closed = eroded(dilated(mask, kGap_mm), kGap_mm);
  std::size_t v = 0;
  for (int k = 0; k < mask.dims[2]; ++k) {
    for (int j = 0; j < mask.dims[1]; ++j) {
      for (int i = 0; i < mask.dims[0]; ++i, ++v) {
        if (closed.set[v] == 0) continue;
        const Vec3 p = body.frame.toLocal(part.place(i, j, k));
        const bool beside = std::abs(p.x) > kAside * body.half_width_mm && std::abs(p.z) < kHeight * body.height_mm;
        if (beside && p.y > 0) mask.set[v] = 1;
      }
    }
  }
}

/// What the wanted vertebra owns on the block: bone that it won, and the column of its body.
Mask coarseMask(const EdgeInput& in, const Block& part) {
  const Block& block = in.scene.block;
  const Body& body = in.spine.wanted;
  Mask mask{part.dims, Vec3{1, 1, 1} * block.step_mm, {}};
  const int nx = part.dims[0], ny = part.dims[1], nz = part.dims[2];
  mask.set.resize(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz));
  if (mask.set.empty()) return mask;
  const Vec3 first = block.voxelAt(part.low_mm);
  const auto inBlock = [&](int i, int j, int k) {
    return block.index(static_cast<int>(std::lround(first.x)) + i, static_cast<int>(std::lround(first.y)) + j,
                       static_cast<int>(std::lround(first.z)) + k);
  };
  const std::vector<float> hu = blurred(block, block.hu, kDenoise_mm, in.scene.threads);
  const double slack = plateSlack(in);
  parallelBlocks(static_cast<std::size_t>(nz), 4, in.scene.threads, [&](std::size_t from, std::size_t to) {
    for (int k = static_cast<int>(from); k < static_cast<int>(to); ++k) {
      for (int j = 0; j < ny; ++j) {
        for (int i = 0; i < nx; ++i) {
          const std::size_t v = inBlock(i, j, k);
          if (in.ownership.owner[v] != kWanted) continue;
          const Vec3 local = body.frame.toLocal(part.place(i, j, k));
          const bool own = hu[v] > in.threshold_hu ? nearBody(body, local, slack) : depthIn(body, local).least() > 0.5;
          mask.set[mask.index(i, j, k)] = own ? 1 : 0;
        }
      }
    }
  });
  closeProcesses(body, part, mask);
  closeAndFill(mask);
  std::size_t v = 0;
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i, ++v) {
        const std::uint8_t owner = in.ownership.owner[inBlock(i, j, k)];
        if (owner != kWanted && owner != kNobody) mask.set[v] = 0;
      }
    }
  }
  keepLargest(mask);
  return mask;
}

/// The CT's voxels that can hold the mask.
VoxelBox boxOf(const EdgeInput& in, const Block& part, const Mask& mask) {
  constexpr double kMargin_mm = 4;
  const Grid& grid = in.ct.grid;
  VoxelBox box{grid.dims, {-1, -1, -1}};
  std::size_t v = 0;
  for (int k = 0; k < mask.dims[2]; ++k) {
    for (int j = 0; j < mask.dims[1]; ++j) {
      for (int i = 0; i < mask.dims[0]; ++i, ++v) {
        if (mask.set[v] == 0) continue;
        const Vec3 d = transposeTimes(grid.direction, part.place(i, j, k));
        const Vec3 at = grid.toVoxel(in.seed_patient) +
                        Vec3{d.x / grid.spacing_mm.x, d.y / grid.spacing_mm.y, d.z / grid.spacing_mm.z};
        for (std::size_t a = 0; a < 3; ++a) {
          const double margin = kMargin_mm / axisOf(grid.spacing_mm, a);
          const double last = grid.dims[a] - 1;
          box.low[a] =
              std::min(box.low[a], static_cast<int>(std::clamp(std::floor(axisOf(at, a) - margin), 0.0, last)));
          box.high[a] =
              std::max(box.high[a], static_cast<int>(std::clamp(std::ceil(axisOf(at, a) + margin), 0.0, last)));
        }
      }
    }
  }
  return box;
}

/// In voxels by axis: `mm`, but no less than `voxels` where they are as fine as the coarsest axis allows.
Vec3 sigmaOf(const Vec3& spacing_mm, double mm, double voxels) {
  const double least = std::max(mm, voxels * std::min({spacing_mm.x, spacing_mm.y, spacing_mm.z}));
  return {least / spacing_mm.x, least / spacing_mm.y, least / spacing_mm.z};
}

/// The CT's own voxels in a box: HU with little noise, and the brightest bone near each.
struct Fine {
  VoxelBox box;
  std::array<int, 3> dims{};
  std::vector<float> hu, brightest;
};

Fine fineOf(const CtVolume& ct, const VoxelBox& box, unsigned threads) {
  Fine fine;
  fine.box = box;
  for (std::size_t a = 0; a < 3; ++a) fine.dims[a] = box.high[a] - box.low[a] + 1;
  fine.hu.reserve(static_cast<std::size_t>(fine.dims[0]) * static_cast<std::size_t>(fine.dims[1]) *
                  static_cast<std::size_t>(fine.dims[2]));
  for (int k = box.low[2]; k <= box.high[2]; ++k) {
    for (int j = box.low[1]; j <= box.high[1]; ++j) {
      const std::int16_t* row = ct.hu.data() + ct.grid.index(box.low[0], j, k);
      fine.hu.insert(fine.hu.end(), row, row + fine.dims[0]);
    }
  }
  const Vec3& s = ct.grid.spacing_mm;
  blur(fine.hu, fine.dims, sigmaOf(s, kDenoise_mm, kDenoise_voxels), threads);
  fine.brightest = fine.hu;
  const auto reach = [](double spacing) { return std::max(1, static_cast<int>(std::lround(kBrightest_mm / spacing))); };
  dilateGrey(fine.brightest, fine.dims, {reach(s.x), reach(s.y), reach(s.z)}, threads);
  return fine;
}

/// Half-way to the bone near by, in part: dense bone blurs outwards, thin bone is dimmed.
bool isBone(const Fine& fine, std::size_t v, double threshold_hu) {
  const double bone = std::clamp<double>(fine.brightest[v], kLeastBone_hu, kMostBone_hu);
  return fine.hu[v] > (1 - kLocal) * threshold_hu + kLocal * 0.5 * (kSoft_hu + bone);
}

/// The mask on the CT's grid, before it is filled.
/// @param depth  below the coarse mask's surface, in mm, on `part`.
Mask fineMask(const EdgeInput& in, const Fine& fine, const Block& part, const std::vector<float>& depth) {
  const Grid& grid = in.ct.grid;
  const Block& block = in.scene.block;
  Mask mask{fine.dims, grid.spacing_mm, std::vector<std::uint8_t>(fine.hu.size())};
  const Vec3 seed = grid.toVoxel(in.seed_patient);
  const double slack = plateSlack(in);
  const auto layer = static_cast<std::size_t>(fine.dims[0]) * static_cast<std::size_t>(fine.dims[1]);
  parallelBlocks(static_cast<std::size_t>(fine.dims[2]), 2, in.scene.threads, [&](std::size_t from, std::size_t to) {
    for (std::size_t v = from * layer; v < to * layer; ++v) {
      const int k = static_cast<int>(v / layer) + fine.box.low[2],
                j = static_cast<int>(v % layer) / fine.dims[0] + fine.box.low[1],
                i = static_cast<int>(v % layer) % fine.dims[0] + fine.box.low[0];
      const Vec3 off = Vec3{1.0 * i, 1.0 * j, 1.0 * k} - seed;
      const Vec3 place =
          grid.direction * Vec3{off.x * grid.spacing_mm.x, off.y * grid.spacing_mm.y, off.z * grid.spacing_mm.z};
      if (!isKnown(block, place)) continue;
      const Vec3 at = block.voxelAt(place);
      const std::size_t near = block.index(static_cast<int>(std::lround(at.x)), static_cast<int>(std::lround(at.y)),
                                           static_cast<int>(std::lround(at.z)));
      if (valueAt(part, depth, place) > kInner_mm) {
        mask.set[v] = 1;
      } else if (in.ownership.owner[near] == kWanted && isBone(fine, v, in.threshold_hu)) {
        mask.set[v] = nearBody(in.spine.wanted, in.spine.wanted.frame.toLocal(place), slack) ? 1 : 0;
      }
    }
  });
  return mask;
}

/// Mean of the mask over about kRough_mm, cut at a half.
void smoothOutline(Mask& mask, unsigned threads) {
  std::vector<float> part(mask.set.begin(), mask.set.end());
  blur(part, mask.dims, sigmaOf(mask.spacing_mm, kRough_mm, kRough_voxels), threads);
  for (std::size_t v = 0; v < part.size(); ++v) mask.set[v] = part[v] > 0.5F ? 1 : 0;
}

}  // namespace

LabelVolume drawEdge(const EdgeInput& in) {
  const Block part = partOwned(in);
  const Mask coarse = coarseMask(in, part);
  LabelVolume out{in.ct.grid, std::vector<std::uint8_t>(in.ct.grid.voxels(), 0)};
  const VoxelBox box = boxOf(in, part, coarse);
  if (box.high[0] < box.low[0]) return out;
  std::vector<float> depth = squaredDistances(coarse, 0);
  for (float& d : depth) d = std::sqrt(std::min(d, 100.0F));
  const Fine fine = fineOf(in.ct, box, in.scene.threads);
  Mask mask = fineMask(in, fine, part, depth);
  fillHoles(mask);
  smoothOutline(mask, in.scene.threads);
  keepLargest(mask);
  std::size_t v = 0;
  for (int k = box.low[2]; k <= box.high[2]; ++k) {
    for (int j = box.low[1]; j <= box.high[1]; ++j) {
      for (int i = box.low[0]; i <= box.high[0]; ++i, ++v) out.inside[in.ct.grid.index(i, j, k)] = mask.set[v];
    }
  }
  return out;
}

}  // namespace spinaltap::segment
