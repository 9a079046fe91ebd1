// A column of vertebrae whose truth is known: the phantom's L3, one above the other so closely that facets touch.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/base/random.h"
#include "core/phantom/ct.h"
#include "core/phantom/phantom.h"
#include "core/volume/grid.h"

namespace spinaltap::segment::scenes {

struct Column {
  volume::CtVolume ct;
  std::vector<volume::LabelVolume> truth;  ///< from above
  std::vector<Vec3> middles;               ///< of the bodies
};

struct ColumnOptions {
  int vertebrae = 3;
  double pitch_mm = 33;  ///< from body to body: 28.6 mm of body and a disc of 4.4, which lets the facets touch
  double noise_hu = 30;
  bool osteoporotic = false;
  volume::Grid grid;
};

/// What the scene holds at a place: HU, and whose bone it is (-1: nobody's).
struct Scenery {
  phantom::Phantom one;
  std::vector<Vec3> shifts;

  struct At {
    double hu, far_mm;  ///< far_mm: no bone is nearer
    int owner;
  };
  /// The nearest bone says what is there. Bones out of reach are told by their boxes, which is quicker.
  [[nodiscard]] At at(const Vec3& p) const {
    const phantom::Bounds box = one.bounds();
    double nearest = 1e300, far = 1e300;
    std::size_t who = 0;
    for (std::size_t n = 0; n < shifts.size(); ++n) {
      const Vec3 q = p - shifts[n];
      const bool in = q.x > box.low_patient.x && q.y > box.low_patient.y && q.z > box.low_patient.z &&
                      q.x < box.high_patient.x && q.y < box.high_patient.y && q.z < box.high_patient.z;
      const double d = in ? one.signedDistance(q) : 100 + std::abs(q.z - one.frame().origin_patient.z);
      const Vec3 below = box.low_patient - q, above = q - box.high_patient;
      far = std::min(far, in ? d / phantom::Phantom::kLipschitz
                             : std::max({below.x, below.y, below.z, above.x, above.y, above.z}));
      if (d < nearest) nearest = d, who = n;
    }
    return {one.trueHu(p - shifts[who]), far, nearest < 0 ? static_cast<int>(who) : -1};
  }
};

constexpr double kCell_mm = 6;

/// The scan of the column on any grid: the mean of two places a voxel, and noise.
inline Column columnOf(const ColumnOptions& o) {
  Scenery scenery{phantom::Phantom::make({.seed = 1, .osteoporotic = o.osteoporotic}), {}};
  const Frame& frame = scenery.one.frame();
  Column column{{o.grid, {}}, {}, {}};
  for (int n = 0; n < o.vertebrae; ++n) {
    scenery.shifts.push_back(frame.axes.col_z * (o.pitch_mm * (0.5 * (o.vertebrae - 1) - n)));
    column.truth.push_back({o.grid, std::vector<std::uint8_t>(o.grid.voxels(), 0)});
    column.middles.push_back(frame.origin_patient + scenery.shifts.back());
  }
  Random random(7);
  const auto& d = o.grid.dims;
  const Vec3 spacing = o.grid.spacing_mm;
  const auto voxels = [](double mm) { return std::max(1, static_cast<int>(kCell_mm / mm)); };
  const std::array<int, 3> cell{voxels(spacing.x), voxels(spacing.y), voxels(spacing.z)};
  const double reach = 0.5 * norm(Vec3{spacing.x * cell[0], spacing.y * cell[1], spacing.z * cell[2]});
  std::vector<Scenery::At> cells;  // what is the same throughout a cell of voxels: most of the stack is far from bone
  const std::array<int, 3> n{d[0] / cell[0] + 1, d[1] / cell[1] + 1, d[2] / cell[2] + 1};
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      for (int i = 0; i < n[0]; ++i) {
        cells.push_back(scenery.at(
            o.grid.toPatient({cell[0] * (i + 0.5) - 0.5, cell[1] * (j + 0.5) - 0.5, cell[2] * (k + 0.5) - 0.5})));
      }
    }
  }
  std::size_t v = 0;
  for (int k = 0; k < d[2]; ++k) {
    for (int j = 0; j < d[1]; ++j) {
      for (int i = 0; i < d[0]; ++i, ++v) {
        const Scenery::At& all =
            cells[static_cast<std::size_t>(i / cell[0] + n[0] * (j / cell[1] + n[1] * (k / cell[2])))];
        const double noise = o.noise_hu * random.gaussian();
        if (all.far_mm > reach) {
          column.ct.hu.push_back(static_cast<std::int16_t>(std::lround(all.hu + noise)));
          continue;
        }
        const Scenery::At a = scenery.at(o.grid.toPatient({i - 0.25, j + 0.25, k - 0.25}));
        const Scenery::At b = scenery.at(o.grid.toPatient({i + 0.25, j - 0.25, k + 0.25}));
        column.ct.hu.push_back(static_cast<std::int16_t>(std::lround(0.5 * (a.hu + b.hu) + noise)));
        // the centre lies between the two: where they disagree it is a toss, which the voxel's parity decides
        const int owner = a.owner == b.owner || (i + j + k) % 2 == 0 ? a.owner : b.owner;
        if (owner >= 0) column.truth[static_cast<std::size_t>(owner)].inside[v] = 1;
      }
    }
  }
  return column;
}

/// Axial slices that hold a column: `spacing` apart, 104 mm wide and deep.
inline volume::Grid gridOf(const Vec3& spacing_mm, double height_mm) {
  const auto one = phantom::Phantom::make({});
  const Vec3 extent{104, 104, height_mm};
  volume::Grid grid;
  grid.spacing_mm = spacing_mm;
  grid.dims = {static_cast<int>(extent.x / spacing_mm.x), static_cast<int>(extent.y / spacing_mm.y),
               static_cast<int>(extent.z / spacing_mm.z)};
  grid.origin_patient = one.frame().origin_patient + Vec3{-0.5 * extent.x, -28, -0.5 * extent.z};
  return grid;
}

inline double dice(const volume::LabelVolume& a, const volume::LabelVolume& b) {
  std::size_t both = 0, sum = 0;
  for (std::size_t v = 0; v < a.inside.size(); ++v) {
    both += a.inside[v] != 0 && b.inside[v] != 0 ? 1 : 0;
    sum += (a.inside[v] != 0 ? 1 : 0) + (b.inside[v] != 0 ? 1 : 0);
  }
  return sum == 0 ? 0 : 2.0 * static_cast<double>(both) / static_cast<double>(sum);
}

}  // namespace spinaltap::segment::scenes
