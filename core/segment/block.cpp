#include "core/segment/block.h"

#include <algorithm>
#include <cmath>

#include "core/base/parallel.h"
#include "core/segment/filter.h"

namespace spinaltap::segment {
namespace {

using volume::CtVolume;
using volume::Grid;

double axisOf(const Vec3& v, std::size_t a) { return a == 0 ? v.x : a == 1 ? v.y : v.z; }
double& axisOf(Vec3& v, std::size_t a) { return a == 0 ? v.x : a == 1 ? v.y : v.z; }

/// Part of the CT, with `factor` voxels averaged into one along each axis.
struct Part {
  std::array<int, 3> dims{0, 0, 0};
  std::array<int, 3> first{0, 0, 0}, factor{1, 1, 1};
  std::vector<float> hu;

  /// Continuous coordinates in the part from those in the CT.
  [[nodiscard]] Vec3 fromCt(const Vec3& v) const {
    Vec3 out;
    for (std::size_t a = 0; a < 3; ++a) axisOf(out, a) = (axisOf(v, a) - first[a] + 0.5) / factor[a] - 0.5;
    return out;
  }
};

/// The voxels that the block can touch, whole groups of them where the CT has them.
Part emptyPart(const Grid& grid, const Vec3& seed, const Vec3& low, const Vec3& high, double step) {
  Part part;
  const Vec3 at = grid.toVoxel(seed);
  const Vec3 half = (high - low) * 0.5, middle = transposeTimes(grid.direction, (high + low) * 0.5);
  const Vec3 columns[3] = {grid.direction.col_x, grid.direction.col_y, grid.direction.col_z};
  for (std::size_t a = 0; a < 3; ++a) {
    const double spacing = axisOf(grid.spacing_mm, a);
    const double reach =
        (std::abs(columns[a].x) * half.x + std::abs(columns[a].y) * half.y + std::abs(columns[a].z) * half.z) / spacing;
    const double centre = axisOf(at, a) + axisOf(middle, a) / spacing;
    const int last = grid.dims[a] - 1;
    const int from = static_cast<int>(std::clamp(std::floor(centre - reach) - 1, 0.0, 1.0 * last));
    const int to = static_cast<int>(std::clamp(std::ceil(centre + reach) + 1, 0.0, 1.0 * last));
    // 1e-9: a spacing of exactly the step, or half of it, must not fall on either side by rounding
    const int wanted = static_cast<int>(std::clamp(step / spacing + 1e-9, 1.0, 64.0));
    part.factor[a] = std::min(wanted, to - from + 1);
    part.dims[a] = (to - from + 1) / part.factor[a];
    part.first[a] = from;
  }
  return part;
}

void averageInto(Part& part, const CtVolume& ct, unsigned threads) {
  const int nx = part.dims[0], ny = part.dims[1], nz = part.dims[2];
  const int fx = part.factor[0], fy = part.factor[1], fz = part.factor[2];
  part.hu.resize(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz));
  const float scale = 1.0F / static_cast<float>(fx * fy * fz);
  parallelBlocks(static_cast<std::size_t>(nz), 1, threads, [&](std::size_t from, std::size_t to) {
    for (std::size_t k = from; k < to; ++k) {
      float* out = part.hu.data() + k * static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
      for (int c = 0; c < fz; ++c) {
        for (int j = 0; j < ny * fy; ++j) {
          const std::int16_t* in = ct.hu.data() + ct.grid.index(part.first[0], part.first[1] + j,
                                                                part.first[2] + static_cast<int>(k) * fz + c);
          float* row = out + static_cast<std::size_t>(j / fy) * static_cast<std::size_t>(nx);
          for (int i = 0; i < nx; ++i) {
            int sum = 0;
            for (int b = 0; b < fx; ++b) sum += in[i * fx + b];
            row[i] += static_cast<float>(sum) * scale;
          }
        }
      }
    }
  });
}

/// Where a coordinate lies between two voxels of an axis.
struct Between {
  std::size_t low, step;
  double part;

  Between(double at, int count, std::size_t stride) {
    const double c = std::clamp(at, 0.0, 1.0 * (count - 1));
    const int first = std::min(static_cast<int>(c), std::max(0, count - 2));
    low = static_cast<std::size_t>(first) * stride, step = first + 1 < count ? stride : 0, part = c - first;
  }
};

double trilinear(const float* values, const std::array<int, 3>& dims, const Vec3& v) {
  const auto row = static_cast<std::size_t>(dims[0]);
  const Between x(v.x, dims[0], 1), y(v.y, dims[1], row), z(v.z, dims[2], row * static_cast<std::size_t>(dims[1]));
  const float* p = values + x.low + y.low + z.low;
  const auto along = [&](const float* q) { return q[0] + x.part * (double{q[x.step]} - q[0]); };
  const auto plane = [&](const float* q) {
    const double near = along(q);
    return near + y.part * (along(q + y.step) - near);
  };
  const double near = plane(p);
  return near + z.part * (plane(p + z.step) - near);
}

/// The box along the patient's axes that holds the whole CT, from the seed.
void reachOf(const Grid& grid, const Vec3& seed, Vec3& least, Vec3& most) {
  least = Vec3{1, 1, 1} * 1e300, most = -least;
  const Vec3 at = grid.toVoxel(seed), s = grid.spacing_mm;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 v{(corner & 1) != 0 ? grid.dims[0] - 0.5 : -0.5, (corner & 2) != 0 ? grid.dims[1] - 0.5 : -0.5,
                 (corner & 4) != 0 ? grid.dims[2] - 0.5 : -0.5};
    const Vec3 p = grid.direction * Vec3{(v.x - at.x) * s.x, (v.y - at.y) * s.y, (v.z - at.z) * s.z};
    least = {std::min(least.x, p.x), std::min(least.y, p.y), std::min(least.z, p.z)};
    most = {std::max(most.x, p.x), std::max(most.y, p.y), std::max(most.z, p.z)};
  }
}

}  // namespace

double valueAt(const Block& block, const std::vector<float>& values, const Vec3& place_mm) {
  return trilinear(values.data(), block.dims, block.voxelAt(place_mm));
}

bool isKnown(const Block& block, const Vec3& place_mm) {
  const Vec3 v = block.voxelAt(place_mm);
  std::array<int, 3> at{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double c = std::round(axisOf(v, a));
    if (!(c >= 0 && c < block.dims[a])) return false;
    at[a] = static_cast<int>(c);
  }
  return block.known[block.index(at[0], at[1], at[2])] != 0;
}

Block blockAround(const CtVolume& ct, const Vec3& seed_patient, const Vec3& low_mm, const Vec3& high_mm, double step_mm,
                  unsigned threads) {
  Part part = emptyPart(ct.grid, seed_patient, low_mm, high_mm, step_mm);
  averageInto(part, ct, threads);
  Block block;
  block.step_mm = step_mm;
  Vec3 least, most;
  reachOf(ct.grid, seed_patient, least, most);
  for (std::size_t a = 0; a < 3; ++a) {
    // the seed is a voxel's centre; one voxel beyond the CT's end
    const double low = std::max(axisOf(low_mm, a), axisOf(least, a)),
                 high = std::min(axisOf(high_mm, a), axisOf(most, a));
    const int below = static_cast<int>(std::ceil(std::max(0.0, -low) / step_mm));
    block.dims[a] = below + static_cast<int>(std::ceil(std::max(0.0, high) / step_mm)) + 1;
    axisOf(block.low_mm, a) = -below * step_mm;
  }
  block.hu.resize(static_cast<std::size_t>(block.dims[0]) * static_cast<std::size_t>(block.dims[1]) *
                  static_cast<std::size_t>(block.dims[2]));
  block.known.resize(block.hu.size());
  const Vec3 seed = ct.grid.toVoxel(seed_patient), spacing = ct.grid.spacing_mm;
  parallelBlocks(static_cast<std::size_t>(block.dims[2]), 4, threads, [&](std::size_t from, std::size_t to) {
    std::size_t v = from * static_cast<std::size_t>(block.dims[0]) * static_cast<std::size_t>(block.dims[1]);
    for (std::size_t k = from; k < to; ++k) {
      for (int j = 0; j < block.dims[1]; ++j) {
        for (int i = 0; i < block.dims[0]; ++i, ++v) {
          const Vec3 d = transposeTimes(ct.grid.direction, block.place(i, j, static_cast<int>(k)));
          const Vec3 c = seed + Vec3{d.x / spacing.x, d.y / spacing.y, d.z / spacing.z};
          bool in = true;
          for (std::size_t a = 0; a < 3; ++a) in = in && axisOf(c, a) >= -0.5 && axisOf(c, a) <= ct.grid.dims[a] - 0.5;
          block.known[v] = in ? 1 : 0;
          block.hu[v] = static_cast<float>(trilinear(part.hu.data(), part.dims, part.fromCt(c)));
        }
      }
    }
  });
  return block;
}

std::vector<float> blurred(const Block& block, const std::vector<float>& values, double sigma_mm, unsigned threads) {
  std::vector<float> out = values;
  blur(out, block.dims, Vec3{1, 1, 1} * (sigma_mm / block.step_mm), threads);
  return out;
}

}  // namespace spinaltap::segment
