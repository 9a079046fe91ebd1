#include "core/surface/smooth_label.h"

#include <algorithm>
#include <cmath>

#include "core/base/parallel.h"
#include "core/volume/sample.h"

namespace spinaltap::surface {
namespace {

// Fine stacks are blurred by about the point spread of the scanner.
constexpr double kLeastSigma_mm = 0.5;

double sigmaOf(double spacing, double blur_voxels) {
  const double sigma = blur_voxels * spacing;
  return blur_voxels < SmoothLabel::kBlur_voxels ? sigma : std::max(sigma, kLeastSigma_mm);
}

std::vector<float> kernelOf(double spacing, double sigma) {
  const int reach = static_cast<int>(std::ceil(3 * sigma / spacing));
  std::vector<float> weights;
  double sum = 0;
  for (int i = -reach; i <= reach; ++i) {
    const double d = i * spacing / sigma;
    weights.push_back(static_cast<float>(std::exp(-d * d / 2)));
    sum += static_cast<double>(weights.back());
  }
  for (float& w : weights) w = static_cast<float>(static_cast<double>(w) / sum);
  return weights;
}

/// One axis in place; the block's first and last values go on beyond it.
void blur(std::vector<float>& values, const std::array<int, 3>& dims, std::size_t axis,
          const std::vector<float>& weights) {
  const std::size_t n[3] = {static_cast<std::size_t>(dims[0]), static_cast<std::size_t>(dims[1]),
                            static_cast<std::size_t>(dims[2])};
  const std::size_t stride[3] = {1, n[0], n[0] * n[1]};
  const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3, reach = weights.size() / 2, count = n[axis];
  parallelBlocks(n[v], 1, 0, [&](std::size_t b, std::size_t) {
    std::vector<float> line(count + 2 * reach);
    for (std::size_t a = 0; a < n[u]; ++a) {
      float* first = values.data() + a * stride[u] + b * stride[v];
      for (std::size_t q = 0; q < line.size(); ++q) {
        line[q] = first[std::clamp(q, reach, reach + count - 1) * stride[axis] - reach * stride[axis]];
      }
      for (std::size_t q = 0; q < count; ++q) {
        float sum = 0;
        for (std::size_t w = 0; w < weights.size(); ++w) sum += weights[w] * line[q + w];
        first[q * stride[axis]] = sum;
      }
    }
  });
}

}  // namespace

SmoothLabel::SmoothLabel(const volume::LabelVolume& label, double blur_voxels) {
  grid_.dims = label.grid.dims;
  grid_.spacing_mm = label.grid.spacing_mm;
  values_.resize(grid_.voxels());
  std::transform(label.inside.begin(), label.inside.end(), values_.begin(),
                 [](std::uint8_t v) { return v != 0 ? 1.0F : 0.0F; });
  const double spacing[3] = {grid_.spacing_mm.x, grid_.spacing_mm.y, grid_.spacing_mm.z};
  for (std::size_t a = 0; a < 3; ++a) {
    blur(values_, grid_.dims, a, kernelOf(spacing[a], sigmaOf(spacing[a], blur_voxels)));
  }
}

Vec3 SmoothLabel::low() const { return grid_.toPatient({-0.5, -0.5, -0.5}); }

Vec3 SmoothLabel::high() const {
  return grid_.toPatient({grid_.dims[0] - 0.5, grid_.dims[1] - 0.5, grid_.dims[2] - 0.5});
}

double SmoothLabel::value(const Vec3& place_mm) const {
  const Vec3& s = grid_.spacing_mm;
  return volume::sampleAtVoxel(grid_, values_, {place_mm.x / s.x, place_mm.y / s.y, place_mm.z / s.z});
}

Vec3 SmoothLabel::gradient(const Vec3& place_mm) const {
  // Half a voxel either way: trilinear pieces have kinks, and a difference across a whole voxel steps over them.
  const Vec3 h = grid_.spacing_mm * 0.5;
  const auto slope = [&](const Vec3& step, double length) {
    return (value(place_mm + step) - value(place_mm - step)) / (2 * length);
  };
  return {slope({h.x, 0, 0}, h.x), slope({0, h.y, 0}, h.y), slope({0, 0, h.z}, h.z)};
}

}  // namespace spinaltap::surface
