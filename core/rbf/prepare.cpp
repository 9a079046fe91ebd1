#include "core/rbf/prepare.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>

namespace spinaltap::rbf {
namespace {

constexpr double kMergeShare = 1e-6;  // of the span: a Cholesky factor in double still tells such centres apart
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
  Vec3 low = samples.positions.front(), high = low;
  for (const Vec3& p : samples.positions) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  out.centroid_patient = low + (high - low) * 0.5;
  out.span_mm = norm(high - low);
  out.positions.reserve(samples.positions.size());
  for (const Vec3& p : samples.positions) out.positions.push_back(p - out.centroid_patient);
  out.distances = samples.distances_mm;
}

/// Sweep along x: only samples whose x differs by less than the radius can be merged.
void mergeDuplicates(PreparedSamples& s) {
  const double radius = kMergeShare * s.span_mm;
  const std::size_t n = s.positions.size();
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&s](std::size_t a, std::size_t b) {
    return s.positions[a].x != s.positions[b].x ? s.positions[a].x < s.positions[b].x : a < b;
  });
  std::vector<std::size_t> leader(n);
  std::iota(leader.begin(), leader.end(), std::size_t{0});
  bool any = false;
  for (std::size_t a = 0; a < n; ++a) {
    if (leader[order[a]] != order[a]) continue;
    for (std::size_t b = a + 1; b < n && s.positions[order[b]].x - s.positions[order[a]].x <= radius; ++b) {
      if (leader[order[b]] == order[b] && norm(s.positions[order[b]] - s.positions[order[a]]) <= radius) {
        leader[order[b]] = order[a];
        any = true;
      }
    }
  }
  if (!any) return;
  std::vector<Vec3> position_sum(n);
  std::vector<double> distance_sum(n, 0.0), count(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    position_sum[leader[i]] += s.positions[i];
    distance_sum[leader[i]] += s.distances[i];
    count[leader[i]] += 1;
  }
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
  return !(least > kFlatShare * kFlatShare * s.span_mm * s.span_mm);
}

}  // namespace

Result<PreparedSamples> prepare(const Samples& samples) {
  if (auto ok = checkSamples(samples); !ok) return tl::unexpected(ok.error());
  PreparedSamples out;
  recentre(samples, out);
  if (!std::isfinite(out.span_mm)) return fail(ErrorCode::NotFinite, "samples are too far apart for double");
  mergeDuplicates(out);
  if (out.positions.size() < 4) return fail(ErrorCode::Degenerate, "a surface needs at least 4 different samples");
  if (liesInAPlane(out)) return fail(ErrorCode::Degenerate, "all samples lie in one plane");
  return out;
}

}  // namespace spinaltap::rbf
