// tests/core/mesh/fields.h - fields and checks that the mesh tests share.
#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "core/mesh/polygonise.h"
#include "tests/core/mesh/mesh_check.h"

namespace spinaltap::mesh {

/// value(point) -> double; the gradient by central differences over 2 * step.
template <class F>
Field fieldOf(F value, double step = 1e-5) {
  Field field;
  field.values = [value](std::span<const Vec3> p, std::span<double> out) {
    for (std::size_t i = 0; i < p.size(); ++i) out[i] = value(p[i]);
  };
  field.gradients = [value, h = step](std::span<const Vec3> p, std::span<Vec3> out) {
    for (std::size_t i = 0; i < p.size(); ++i) {
      const auto slope = [&](const Vec3& d) { return (value(p[i] + d) - value(p[i] - d)) / (2 * h); };
      out[i] = {slope({h, 0, 0}), slope({0, h, 0}), slope({0, 0, h})};
    }
  };
  return field;
}

inline double torus(const Vec3& p) {
  const double ring = std::sqrt(p.x * p.x + p.y * p.y) - 10;
  return std::sqrt(ring * ring + p.z * p.z) - 3;
}

inline PolygoniseOptions boxOf(double half, double cell) { return {cell, {-half, -half, -half}, {half, half, half}}; }

/// All that polygonise promises of any mesh.
inline MeshCheck expectSound(const TriangleMesh& m) {
  const MeshCheck c = check(m);
  EXPECT_EQ(c.open_edges, 0U);
  EXPECT_EQ(c.repeated_edges, 0U);
  EXPECT_EQ(c.pinched_vertices, 0U);
  EXPECT_EQ(c.coincident_vertices, 0U);
  EXPECT_GE(c.least_angle_deg, kLeastAngle_deg);
  EXPECT_EQ(m.normals.size(), m.vertices.size());
  for (const Vec3& n : m.normals) EXPECT_NEAR(norm(n), 1, 1e-12);
  return c;
}

}  // namespace spinaltap::mesh
