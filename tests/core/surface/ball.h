// tests/core/surface/ball.h - a ball of bone in a CT of any grid, and how far points are from it.
#pragma once
#include <algorithm>
#include <cmath>

#include "core/base/dmath.h"
#include "core/surface/surface.h"

namespace spinaltap::surface {

using volume::CtVolume;
using volume::Grid;
using volume::LabelVolume;

struct Scan {
  CtVolume ct;
  LabelVolume label;
};

/// A ball with a dense shell. HU are blurred across the edge over 1 mm, as a scanner's; the label is its voxels.
struct Ball {
  Vec3 middle;
  double radius = 12;
  double inside_hu = 800, outside_hu = 40;

  [[nodiscard]] double hu(const Vec3& p) const {
    const double d = norm(p - middle) - radius;
    return outside_hu + (inside_hu - outside_hu) * std::clamp(0.5 - d, 0.0, 1.0);
  }
};

inline Scan scan(const Grid& grid, const Ball& ball) {
  Scan out{{grid, {}}, {grid, {}}};
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      for (int i = 0; i < grid.dims[0]; ++i) {
        const Vec3 p = grid.toPatient({1.0 * i, 1.0 * j, 1.0 * k});
        out.ct.hu.push_back(static_cast<std::int16_t>(std::lround(ball.hu(p))));
        out.label.inside.push_back(norm(p - ball.middle) <= ball.radius ? 1 : 0);
      }
    }
  }
  return out;
}

inline Grid gridAround(const Vec3& middle, const Vec3& spacing, double half_mm, const Mat3& direction = {}) {
  Grid g;
  g.spacing_mm = spacing;
  g.direction = direction;
  g.dims = {static_cast<int>(2 * half_mm / spacing.x) + 1, static_cast<int>(2 * half_mm / spacing.y) + 1,
            static_cast<int>(2 * half_mm / spacing.z) + 1};
  g.origin_patient = middle - direction * Vec3{half_mm, half_mm, half_mm};
  return g;
}

inline Mat3 turned() {
  const SinCos a = sinCos(0.5), b = sinCos(0.3);
  Mat3 m;
  m.col_x = {a.cos, a.sin, 0};
  m.col_y = {-a.sin * b.cos, a.cos * b.cos, b.sin};
  m.col_z = cross(m.col_x, m.col_y);
  return m;
}

struct Errors {
  double rms = 0, worst = 0, worst_cosine = 1;
};

inline Errors errorsOf(const OrientedPoints& points, const Ball& ball) {
  Errors e;
  for (std::size_t i = 0; i < points.normals.size(); ++i) {
    const Vec3 d = points.positions_patient[i] - ball.middle;
    const double off = norm(d) - ball.radius;
    e.rms += off * off;
    e.worst = std::max(e.worst, std::abs(off));
    e.worst_cosine = std::min(e.worst_cosine, dot(points.normals[i], normalized(d)));
  }
  e.rms = std::sqrt(e.rms / static_cast<double>(points.normals.size()));
  return e;
}

}  // namespace spinaltap::surface
