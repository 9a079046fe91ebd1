#include "core/rbf/smoothing.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/parallel.h"
#include "core/rbf/dense_system.h"
#include "core/rbf/subdomains.h"

namespace spinaltap::rbf {
namespace {

constexpr std::size_t kNeighbours = 64, kNoisePlaces = 400;
constexpr std::size_t kPatch = 480, kPatchInner = 200, kPatches = 8;
constexpr Eigen::Index kQuadratic = 10;  // coefficients
constexpr int kBisections = 14;

/// What a quadratic in three variables leaves of the values, as a standard deviation; negative when it cannot be told.
double leftByQuadratic(std::span<const Vec3> points, std::span<const double> values, const Subdomain& place) {
  const Eigen::Index n = static_cast<Eigen::Index>(place.points.size());
  if (n < 2 * kQuadratic) return -1;
  Vec3 middle;
  for (const std::uint32_t i : place.points) middle += points[i];
  middle = middle / static_cast<double>(n);
  double reach = 0;
  for (const std::uint32_t i : place.points) reach = std::max(reach, norm(points[i] - middle));
  if (!(reach > 0)) return -1;
  Eigen::MatrixXd a(n, kQuadratic);
  Eigen::VectorXd b(n);
  for (Eigen::Index r = 0; r < n; ++r) {
    const std::uint32_t i = place.points[static_cast<std::size_t>(r)];
    const Vec3 p = (points[i] - middle) / reach;
    a.row(r) << 1, p.x, p.y, p.z, p.x * p.x, p.y * p.y, p.z * p.z, p.x * p.y, p.x * p.z, p.y * p.z;
    b(r) = values[i];
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(a);
  const double squares = (b - a * qr.solve(b)).squaredNorm();
  return std::sqrt(squares / static_cast<double>(n - qr.rank()));
}

/// One patch of the set: its residual for a ridge is ridge * u.
double patchSquares(std::span<const Vec3> points, std::span<const double> values, const Subdomain& patch,
                    double ridge) {
  std::vector<Vec3> own;
  std::vector<double> wanted;
  for (const std::uint32_t i : patch.points) own.push_back(points[i]), wanted.push_back(values[i]);
  const auto system = DenseSystem<double>::make(own, ridge, 1);
  if (!system) return 0;
  std::vector<double> u(own.size());
  (void)system->solve(wanted, u);
  double squares = 0;
  for (std::size_t i = 0; i < patch.inner; ++i) squares += ridge * u[i] * ridge * u[i];
  return squares / static_cast<double>(patch.inner);
}

}  // namespace

double estimateNoise(std::span<const Vec3> points, std::span<const double> values, unsigned threads) {
  const std::vector<Subdomain> places = someSubdomains(points, kNeighbours / 2, kNeighbours, kNoisePlaces);
  std::vector<double> left(places.size());
  parallelBlocks(places.size(), 8, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) left[n] = leftByQuadratic(points, values, places[n]);
  });
  std::erase_if(left, [](double x) { return x < 0; });
  if (left.empty()) return 0;
  const auto middle = left.begin() + static_cast<std::ptrdiff_t>(left.size() / 2);
  std::nth_element(left.begin(), middle, left.end());
  return *middle;
}

double ridgeFor(double noise, std::span<const Vec3> points, std::span<const double> values, unsigned threads) {
  if (!(noise > 0)) return 0;
  const std::vector<Subdomain> patches = someSubdomains(points, kPatchInner, kPatch, kPatches);
  const auto residual = [&](double ridge) {
    std::vector<double> squares(patches.size());
    parallelBlocks(patches.size(), 1, threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) squares[n] = patchSquares(points, values, patches[n], ridge);
    });
    double sum = 0;
    for (const double s : squares) sum += s;
    return std::sqrt(sum / static_cast<double>(patches.size()));
  };
  // Positions are in units of the whole set: from far below its spacing to the set itself.
  double low = std::log(1e-7), high = std::log(1.0);
  if (residual(std::exp(low)) >= noise) return 0;
  for (int n = 0; n < kBisections; ++n) {
    const double middle = 0.5 * (low + high);
    (residual(std::exp(middle)) < noise ? low : high) = middle;
  }
  return std::exp(0.5 * (low + high));
}

}  // namespace spinaltap::rbf
