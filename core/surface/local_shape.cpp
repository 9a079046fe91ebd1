#include "core/surface/local_shape.h"

#include <array>
#include <cmath>

namespace spinaltap::surface {
namespace {

constexpr double kSameWall = 0.35;  // cosine
constexpr std::size_t kTerms = 6;   // 1, u, v, u^2, uv, v^2
using Row = std::array<double, kTerms>;

// What is likely before any point is seen, so that few points do not bend the quadric: in units of the radius, points
// off by 0.05, slopes of 0.25, curvatures that rise by 0.25 over it.
constexpr double kSlopeRidge = 0.04, kCurveRidge = 0.04;
constexpr Row kRidge{1e-6, kSlopeRidge, kSlopeRidge, kCurveRidge, kCurveRidge, kCurveRidge};

struct Sums {
  std::array<Row, kTerms> normal{};  ///< lower triangle
  Row right{};
  double weight = 0, squares = 0;

  void add(const Row& row, double height, double w) {
    for (std::size_t i = 0; i < kTerms; ++i) {
      right[i] += w * row[i] * height;
      for (std::size_t j = 0; j <= i; ++j) normal[i][j] += w * row[i] * row[j];
    }
    weight += w, squares += w * height * height;
  }

  [[nodiscard]] Row solved(const Row& ridge) const {
    std::array<Row, kTerms> l{};
    Row y{};
    for (std::size_t i = 0; i < kTerms; ++i) {
      double rest = right[i];
      for (std::size_t j = 0; j <= i; ++j) {
        double sum = normal[i][j] + (i == j ? ridge[i] : 0.0);
        for (std::size_t k = 0; k < j; ++k) sum -= l[i][k] * l[j][k];
        l[i][j] = i == j ? std::sqrt(std::max(sum, 1e-300)) : sum / l[j][j];
        if (j < i) rest -= l[i][j] * y[j];
      }
      y[i] = rest / l[i][i];
    }
    for (std::size_t i = kTerms; i-- > 0;) {
      for (std::size_t k = i + 1; k < kTerms; ++k) y[i] -= l[k][i] * y[k];
      y[i] /= l[i][i];
    }
    return y;
  }
};

}  // namespace

LocalShape shapeAround(const SurfacePoints& points, std::size_t which, double radius_mm) {
  const Vec3 place = points.places[which], n = points.normals[which];
  const Vec3 helper = std::abs(n.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 u = normalized(cross(n, helper)), v = cross(n, u);
  Sums sums;
  LocalShape out{n, 0, 0, 0};
  points.near->eachWithin(place, radius_mm, [&](std::size_t q) {
    if (dot(points.normals[q], n) < kSameWall) return;
    const Vec3 d = (points.places[q] - place) / radius_mm;
    const double a = dot(d, u), b = dot(d, v);
    sums.add({1, a, b, a * a, a * b, b * b}, dot(d, n), std::exp(-2 * dot(d, d)));
    ++out.points;
  });
  if (out.points < kLeastForShape) return out;
  const Row c = sums.solved(kRidge);
  out.normal = normalized(n - u * c[1] - v * c[2]);
  out.height_mm = c[0] * radius_mm;
  double rest = sums.squares;
  for (std::size_t i = 0; i < kTerms; ++i) rest -= c[i] * (sums.right[i] + kRidge[i] * c[i]);  // the ridge is no height
  out.rms_mm = std::sqrt(std::max(rest, 0.0) / sums.weight) * radius_mm;
  return out;
}

}  // namespace spinaltap::surface
