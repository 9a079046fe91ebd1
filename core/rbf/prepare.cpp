#include "core/rbf/prepare.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "core/base/box.h"

namespace spinaltap::rbf {
namespace {

constexpr double kMergeShare = 1e-4;  // of the usual spacing
constexpr double kFlatShare = 1e-6;

Result<void> checkSamples(const Samples& samples) {
  if (samples.positions.size() != samples.distances_mm.size()) {
    return fail(ErrorCode::InvalidArgument, std::to_string(samples.positions.size()) + " sample positions but " +
                                                std::to_string(samples.distances_mm.size()) + " distances");
  }
  for (std::size_t i = 0; i < samples.positions.size(); ++i) {
    if (!isFinite(samples.positions[i]) || !std::isfinite(samples.distances_mm[i])) {
      return fail(ErrorCode::NotFinite, "sample " + std::to_string(i) + " is not finite");
    }
  }
  if (samples.positions.size() < 4) return fail(ErrorCode::Degenerate, "a surface needs at least 4 samples");
  return {};
}

void recentre(const Samples& samples, PreparedSamples& out) {
  const auto [low, high] = boxAround(samples.positions);
  out.centroid_patient = low + (high - low) * 0.5;
  out.scale_mm = norm(high - low);
  if (!(out.scale_mm > 0)) out.scale_mm = 1;
  out.positions.reserve(samples.positions.size());
  for (const Vec3& p : samples.positions) {
    const Vec3 relative = p - out.centroid_patient;
    out.radius_mm = std::max(out.radius_mm, norm(relative));
    out.positions.push_back(relative / out.scale_mm);
  }
  out.distances = samples.distances_mm;
}

/// Sweep along a direction in which the points of a lattice do not coincide: only samples closer than the radius along
/// it can be merged. leader[i] is the sample that i is merged with, or i.
std::vector<std::size_t> leadersOf(const std::vector<Vec3>& points, double radius) {
  const std::size_t n = points.size();
  const Vec3 direction = normalized({0.5417, 0.7213, 0.4319});
  std::vector<std::pair<double, std::size_t>> order(n);
  for (std::size_t i = 0; i < n; ++i) order[i] = {dot(points[i], direction), i};
  std::sort(order.begin(), order.end());
  std::vector<std::size_t> leader(n);
  std::iota(leader.begin(), leader.end(), std::size_t{0});
  for (std::size_t a = 0; a < n; ++a) {
    const std::size_t i = order[a].second;
    if (leader[i] != i) continue;
    for (std::size_t b = a + 1; b < n && order[b].first - order[a].first <= radius; ++b) {
      const std::size_t j = order[b].second;
      if (leader[j] == j && norm(points[j] - points[i]) <= radius) leader[j] = i;
    }
  }
  return leader;
}

void mergeDuplicates(PreparedSamples& s) {
  const std::size_t n = s.positions.size();
  const std::vector<std::size_t> leader = leadersOf(s.positions, kMergeShare / std::sqrt(static_cast<double>(n)));
  std::vector<Vec3> position_sum(n);
  std::vector<double> distance_sum(n, 0.0), count(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    s.merged += leader[i] != i ? 1 : 0;
    position_sum[leader[i]] += s.positions[i];
    distance_sum[leader[i]] += s.distances[i];
    count[leader[i]] += 1;
  }
  if (s.merged == 0) return;
  s.positions.clear(), s.distances.clear();
  for (std::size_t i = 0; i < n; ++i) {
    if (leader[i] != i) continue;
    s.positions.push_back(position_sum[i] / count[i]);
    s.distances.push_back(distance_sum[i] / count[i]);
  }
}

bool liesInAPlane(const PreparedSamples& s) {
  Vec3 mean;
  for (const Vec3& p : s.positions) mean += p;
  mean = mean / static_cast<double>(s.positions.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vec3& p : s.positions) {
    const Eigen::Vector3d d(p.x - mean.x, p.y - mean.y, p.z - mean.z);
    spread += d * d.transpose();
  }
  spread /= static_cast<double>(s.positions.size());
  const double least = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread, Eigen::EigenvaluesOnly).eigenvalues()(0);
  return !(least > kFlatShare * kFlatShare);
}

}  // namespace

Result<PreparedSamples> prepare(const Samples& samples) {
  if (auto ok = checkSamples(samples); !ok) return tl::unexpected(ok.error());
  PreparedSamples out;
  recentre(samples, out);
  if (!std::isfinite(out.scale_mm)) return fail(ErrorCode::NotFinite, "samples are too far apart for double");
  mergeDuplicates(out);
  if (out.positions.size() < 4) return fail(ErrorCode::Degenerate, "a surface needs at least 4 different samples");
  if (liesInAPlane(out)) return fail(ErrorCode::Degenerate, "all samples lie in one plane");
  return out;
}

}  // namespace spinaltap::rbf
