#include "core/segment/filter.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/base/parallel.h"

namespace spinaltap::segment {
namespace {

/// Calls work(padded, out, stride, count) for every line along an axis; padded[q] for q = -reach .. count - 1 + reach.
template <class Work>
void eachLine(std::vector<float>& values, const std::array<int, 3>& dims, std::size_t axis, int reach, unsigned threads,
              const Work& work) {
  const auto n = [&](std::size_t a) { return static_cast<std::size_t>(dims[a]); };
  const std::size_t stride[3] = {1, n(0), n(0) * n(1)};
  const std::size_t u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
  const int last = dims[axis] - 1;
  parallelBlocks(n(v), 4, threads, [&](std::size_t from, std::size_t to) {
    std::vector<float> line(n(axis) + 2 * static_cast<std::size_t>(reach));
    for (std::size_t b = from; b < to; ++b) {
      for (std::size_t a = 0; a < n(u); ++a) {
        float* first = values.data() + a * stride[u] + b * stride[v];
        for (int q = -reach; q <= last + reach; ++q) {
          line[static_cast<std::size_t>(q + reach)] =
              first[static_cast<std::size_t>(std::clamp(q, 0, last)) * stride[axis]];
        }
        work(line.data() + reach, first, stride[axis], n(axis));
      }
    }
  });
}

std::vector<float> gaussian(double sigma) {
  std::vector<float> kernel;
  double sum = 0;
  for (int r = 0; r <= static_cast<int>(std::ceil(3 * sigma)); ++r) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * r * r / (sigma * sigma))));
    sum += (r == 0 ? 1 : 2) * static_cast<double>(kernel.back());
  }
  for (float& k : kernel) k = static_cast<float>(k / sum);
  return kernel;
}

double axisOf(const Vec3& v, std::size_t a) { return a == 0 ? v.x : a == 1 ? v.y : v.z; }

}  // namespace

void blur(std::vector<float>& values, const std::array<int, 3>& dims, const Vec3& sigma, unsigned threads) {
  constexpr double kLeastSigma = 0.25;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (axisOf(sigma, axis) < kLeastSigma || dims[axis] < 2) continue;
    const std::vector<float> kernel = gaussian(axisOf(sigma, axis));
    const int reach = static_cast<int>(kernel.size()) - 1;
    eachLine(values, dims, axis, reach, threads,
             [&](const float* in, float* out, std::size_t stride, std::size_t count) {
               for (std::size_t q = 0; q < count; ++q) {
                 const float* at = in + q;
                 float sum = kernel[0] * at[0];
                 for (int r = 1; r <= reach; ++r) sum += kernel[static_cast<std::size_t>(r)] * (at[r] + at[-r]);
                 out[q * stride] = sum;
               }
             });
  }
}

void dilateGrey(std::vector<float>& values, const std::array<int, 3>& dims, const std::array<int, 3>& reach,
                unsigned threads) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (reach[axis] < 1) continue;
    eachLine(values, dims, axis, reach[axis], threads,
             [&](const float* in, float* out, std::size_t stride, std::size_t count) {
               for (std::size_t q = 0; q < count; ++q) {
                 out[q * stride] = *std::max_element(in + q - reach[axis], in + q + reach[axis] + 1);
               }
             });
  }
}

}  // namespace spinaltap::segment
