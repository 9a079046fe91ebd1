#include "core/segment/valley.h"

#include <algorithm>
#include <cmath>

#include "core/base/parallel.h"

namespace spinaltap::segment {
namespace {

struct Hessian {
  double xx, yy, zz, xy, xz, yz;
};

Hessian hessianAt(const float* p, std::ptrdiff_t sx, std::ptrdiff_t sy, std::ptrdiff_t sz) {
  const auto second = [&](std::ptrdiff_t s) { return double{p[s]} + p[-s] - 2 * p[0]; };
  const auto mixed = [&](std::ptrdiff_t s, std::ptrdiff_t t) {
    return 0.25 * (double{p[s + t]} + p[-s - t] - p[s - t] - p[t - s]);
  };
  return {second(sx), second(sy), second(sz), mixed(sx, sy), mixed(sx, sz), mixed(sy, sz)};
}

/// Of a symmetric matrix, by Newton's method from above on the characteristic polynomial (no trigonometry: the same
/// bits on every target). Between the largest root and +infinity the polynomial is convex and rising, so the steps
/// descend onto it.
double largestEigenvalue(const Hessian& h) {
  const double mean = (h.xx + h.yy + h.zz) / 3;
  const double a = h.xx - mean, b = h.yy - mean, c = h.zz - mean;
  const double off = h.xy * h.xy + h.xz * h.xz + h.yz * h.yz;
  const double p = 0.5 * (a * a + b * b + c * c) + off;  // x^3 - p x - q = 0, roots sum to 0
  if (p <= 0) return mean;
  const double q = a * b * c + 2 * h.xy * h.xz * h.yz - a * h.yz * h.yz - b * h.xz * h.xz - c * h.xy * h.xy;
  double x = 2 * std::sqrt(p / 3);  // no root is larger
  for (int step = 0; step < 12; ++step) {
    const double slope = 3 * x * x - p;
    if (slope <= 0) break;
    x -= (x * x * x - p * x - q) / slope;
  }
  return mean + x;
}

}  // namespace

std::vector<float> valleyDepth(const Block& block, const std::vector<float>& values, double least_hu,
                               unsigned threads) {
  std::vector<float> out(values.size(), 0);
  const int nx = block.dims[0], ny = block.dims[1], nz = block.dims[2];
  const std::ptrdiff_t sy = nx, sz = sy * ny;
  parallelBlocks(static_cast<std::size_t>(nz), 4, threads, [&](std::size_t from, std::size_t to) {
    for (int k = std::max(1, static_cast<int>(from)); k < std::min(nz - 1, static_cast<int>(to)); ++k) {
      for (int j = 1; j + 1 < ny; ++j) {
        for (int i = 1; i + 1 < nx; ++i) {
          const std::size_t v = block.index(i, j, k);
          if (values[v] < least_hu) continue;
          out[v] = static_cast<float>(std::max(0.0, largestEigenvalue(hessianAt(&values[v], 1, sy, sz))));
        }
      }
    }
  });
  return out;
}

}  // namespace spinaltap::segment
