#include "core/surface/smooth_label.h"

#include <algorithm>
#include <cmath>

#include "core/volume/sample.h"

namespace spinaltap::surface {
namespace {

// Half a voxel irons out the steps between voxels and leaves a plate one voxel thick standing (its middle keeps 0.79);
// fine stacks are blurred by 0.5 mm, about the point spread of the scanner.
constexpr double kSigma_voxels = 0.5;
constexpr double kLeastSigma_mm = 0.5;

double sigmaOf(double spacing) { return std::max(kSigma_voxels * spacing, kLeastSigma_mm); }

int reachOf(double spacing) { return static_cast<int>(std::ceil(3 * sigmaOf(spacing) / spacing)); }

std::vector<float> kernelOf(double spacing) {
  const int reach = reachOf(spacing);
  std::vector<float> weights;
  double sum = 0;
  for (int i = -reach; i <= reach; ++i) {
    const double d = i * spacing / sigmaOf(spacing);
    weights.push_back(static_cast<float>(std::exp(-d * d / 2)));
    sum += static_cast<double>(weights.back());
  }
  for (float& w : weights) w = static_cast<float>(static_cast<double>(w) / sum);
  return weights;
}

/// One axis in place; what lies beyond the block is 0.
void blur(std::vector<float>& values, const std::array<int, 3>& dims, std::size_t axis, double spacing) {
  const std::vector<float> weights = kernelOf(spacing);
  const int reach = reachOf(spacing), count = dims[axis];
  const std::size_t n[3] = {static_cast<std::size_t>(dims[0]), static_cast<std::size_t>(dims[1]),
                            static_cast<std::size_t>(dims[2])};
  const std::size_t stride[3] = {1, n[0], n[0] * n[1]};
  const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
  std::vector<float> line(static_cast<std::size_t>(count + 2 * reach), 0.0F);
  for (std::size_t b = 0; b < n[v]; ++b) {
    for (std::size_t a = 0; a < n[u]; ++a) {
      float* first = values.data() + a * stride[u] + b * stride[v];
      for (int q = 0; q < count; ++q) {
        line[static_cast<std::size_t>(q + reach)] = first[static_cast<std::size_t>(q) * stride[axis]];
      }
      for (int q = 0; q < count; ++q) {
        float sum = 0;
        for (std::size_t w = 0; w < weights.size(); ++w) sum += weights[w] * line[static_cast<std::size_t>(q) + w];
        first[static_cast<std::size_t>(q) * stride[axis]] = sum;
      }
    }
  }
}

}  // namespace

SmoothLabel::SmoothLabel(const volume::LabelVolume& label) {
  const volume::Grid& grid = label.grid;
  const double spacing[3] = {grid.spacing_mm.x, grid.spacing_mm.y, grid.spacing_mm.z};
  std::array<int, 3> pad{};
  for (std::size_t a = 0; a < 3; ++a) pad[a] = reachOf(spacing[a]) + 1, padded_.dims[a] = grid.dims[a] + 2 * pad[a];
  padded_.spacing_mm = grid.spacing_mm;
  padded_.origin_patient = {-pad[0] * spacing[0], -pad[1] * spacing[1], -pad[2] * spacing[2]};
  values_.assign(padded_.voxels(), 0.0F);
  std::size_t from = 0;
  for (int k = 0; k < grid.dims[2]; ++k) {
    for (int j = 0; j < grid.dims[1]; ++j) {
      std::size_t to = padded_.index(pad[0], j + pad[1], k + pad[2]);
      for (int i = 0; i < grid.dims[0]; ++i) values_[to++] = label.inside[from++] != 0 ? 1.0F : 0.0F;
    }
  }
  for (std::size_t a = 0; a < 3; ++a) blur(values_, padded_.dims, a, spacing[a]);
}

Vec3 SmoothLabel::high() const {
  return padded_.toPatient({padded_.dims[0] - 1.0, padded_.dims[1] - 1.0, padded_.dims[2] - 1.0});
}

double SmoothLabel::value(const Vec3& place_mm) const {
  return volume::sampleAtVoxel(padded_, values_, padded_.toVoxel(place_mm));
}

Vec3 SmoothLabel::gradient(const Vec3& place_mm) const {
  // Half a voxel either way: trilinear pieces have kinks, and a difference across a whole voxel steps over them.
  const Vec3 h = padded_.spacing_mm * 0.5;
  const auto slope = [&](const Vec3& step, double length) {
    return (value(place_mm + step) - value(place_mm - step)) / (2 * length);
  };
  return {slope({h.x, 0, 0}, h.x), slope({0, h.y, 0}, h.y), slope({0, 0, h.z}, h.z)};
}

}  // namespace spinaltap::surface
