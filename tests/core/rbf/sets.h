// tests/core/rbf/sets.h - point sets, models and plain sums that the rbf tests share.
#pragma once
#include <cmath>
#include <span>
#include <vector>

#include "core/base/random.h"
#include "core/rbf/rbf.h"

namespace spinaltap::rbf {

inline Vec3 randomPoint(Random& random, double half) {
  return {random.uniform(-half, half), random.uniform(-half, half), random.uniform(-half, half)};
}

inline Vec3 randomDirection(Random& random) {
  while (true) {
    const Vec3 p = randomPoint(random, 1);
    if (norm(p) > 0.1 && norm(p) <= 1) return normalized(p);
  }
}

/// Signed distances to a sphere of radius 20 `unit`: on it, 1 unit inside and 1 outside; 3 samples a count.
inline Samples sphere(std::size_t count, const Vec3& middle, std::uint64_t seed, double noise = 0, double unit = 1) {
  Random random(seed);
  Samples s;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 d = randomDirection(random);
    const double error = noise * random.gaussian();
    for (const double offset : {0.0, 1.0, -1.0}) {
      s.positions.push_back(middle + d * ((20 + offset + error) * unit));
      s.distances_mm.push_back(offset * unit);
    }
  }
  return s;
}

/// s(x) by the formula in the header, in long double.
inline double plainValue(const Model& m, const Vec3& point) {
  const Vec3 p = point - m.centroid_patient;
  long double sum = m.constant + dot(m.linear, p);
  for (std::size_t i = 0; i < m.centres.size(); ++i)
    sum += static_cast<long double>(m.weights[i]) * norm(p - m.centres[i]);
  const double beyond = norm(p) - m.radius_mm;
  const double s = static_cast<double>(sum);
  return m.radius_mm > 0 && beyond > 0 ? std::max(s, beyond) : s;
}

struct Residuals {
  double largest = 0, rms = 0;
};

inline Residuals plainResiduals(const Model& m, const Samples& s) {
  Residuals out;
  for (std::size_t i = 0; i < s.positions.size(); ++i) {
    const double e = plainValue(m, s.positions[i]) - s.distances_mm[i];
    out.largest = std::max(out.largest, std::abs(e));
    out.rms += e * e;
  }
  out.rms = std::sqrt(out.rms / static_cast<double>(s.positions.size()));
  return out;
}

inline Model someModel(std::size_t centres, std::uint64_t seed) {
  Random random(seed);
  Model m;
  m.centroid_patient = {1e5, 2e5, -3e5};
  for (std::size_t i = 0; i < centres; ++i) {
    m.centres.push_back(randomPoint(random, 40));
    m.weights.push_back(random.uniform(-1, 1));
  }
  m.constant = 3;
  m.linear = {0.1, 0.2, -0.3};
  return m;
}

}  // namespace spinaltap::rbf
