#include "core/surface/neighbours.h"

#include <algorithm>
#include <cmath>

namespace spinaltap::surface {
namespace {

constexpr double kMostCells = 4e6;  // a stray point far away must not cost memory: the cells grow instead

}  // namespace

Neighbours::Neighbours(std::span<const Vec3> points, double cell_mm) : points_(points), cell_mm_(cell_mm) {
  Vec3 high;
  if (!points.empty()) low_ = high = points.front();
  for (const Vec3& p : points) {
    low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y), std::min(low_.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  const Vec3 size = high - low_;
  const auto cells = [&size](double cell) {
    return (std::floor(size.x / cell) + 1) * (std::floor(size.y / cell) + 1) * (std::floor(size.z / cell) + 1);
  };
  while (cells(cell_mm_) > kMostCells) cell_mm_ *= 2;
  dims_ = {static_cast<int>(size.x / cell_mm_) + 1, static_cast<int>(size.y / cell_mm_) + 1,
           static_cast<int>(size.z / cell_mm_) + 1};
  const std::size_t count = cellIndex(dims_[0] - 1, dims_[1] - 1, dims_[2] - 1) + 1;
  first_.assign(count + 1, 0);
  std::vector<std::size_t> home(points.size());
  for (std::size_t p = 0; p < points.size(); ++p) {
    const auto c = cellOf(points[p]);
    home[p] = cellIndex(c[0], c[1], c[2]);
    ++first_[home[p] + 1];
  }
  for (std::size_t c = 0; c < count; ++c) first_[c + 1] += first_[c];
  std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
  order_.resize(points.size());
  for (std::size_t p = 0; p < points.size(); ++p) order_[next[home[p]]++] = p;
}

std::array<int, 3> Neighbours::cellOf(const Vec3& place) const {
  const Vec3 d = (place - low_) / cell_mm_;
  return {static_cast<int>(std::clamp(d.x, 0.0, dims_[0] - 1.0)),
          static_cast<int>(std::clamp(d.y, 0.0, dims_[1] - 1.0)),
          static_cast<int>(std::clamp(d.z, 0.0, dims_[2] - 1.0))};
}

std::size_t Neighbours::cellIndex(int i, int j, int k) const {
  return static_cast<std::size_t>(i) +
         static_cast<std::size_t>(dims_[0]) *
             (static_cast<std::size_t>(j) + static_cast<std::size_t>(dims_[1]) * static_cast<std::size_t>(k));
}

}  // namespace spinaltap::surface
