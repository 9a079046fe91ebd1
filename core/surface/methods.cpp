#include "core/surface/methods.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/volume/crop.h"

namespace spinaltap::surface {
namespace {

constexpr std::array<std::pair<Method, std::string_view>, 3> kNames{
    {{Method::Pixel, "pixel"}, {Method::Normal, "normal"}, {Method::Subvoxel, "subvoxel"}}};

constexpr std::array<std::array<int, 2>, 4> kAround{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};

/// A label whose every place can be asked; outside the grid is outside the bone.
struct Pixels {
  const volume::LabelVolume& label;

  [[nodiscard]] bool inside(int i, int j, int k) const {
    return label.grid.contains(i, j, k) && label.inside[label.grid.index(i, j, k)] != 0;
  }
  [[nodiscard]] bool onBoundary(int i, int j, int k) const {
    return inside(i, j, k) &&
           std::any_of(kAround.begin(), kAround.end(), [&](const auto& d) { return !inside(i + d[0], j + d[1], k); });
  }
  [[nodiscard]] Vec3 place(int i, int j, int k) const { return label.grid.toPatient({1.0 * i, 1.0 * j, 1.0 * k}); }

  /// Zero where the neighbours outside cancel out.
  [[nodiscard]] Vec3 normal(int i, int j, int k) const {
    Vec3 sum;
    for (const auto& d : kAround) {
      if (!inside(i + d[0], j + d[1], k)) {
        sum += Vec3{d[0] * label.grid.spacing_mm.x, d[1] * label.grid.spacing_mm.y, 0};
      }
    }
    const double length = norm(sum);
    return length > 0 ? label.grid.direction * (sum / length) : Vec3{};
  }

  template <class Use>
  void eachBoundary(const Use& use) const {
    const auto& dims = label.grid.dims;
    for (int k = 0; k < dims[2]; ++k)
      for (int j = 0; j < dims[1]; ++j)
        for (int i = 0; i < dims[0]; ++i)
          if (onBoundary(i, j, k)) use(i, j, k);
  }
};

OrientedPoints boundaryPixels(const Pixels& pixels) {
  OrientedPoints out;
  pixels.eachBoundary([&](int i, int j, int k) {
    out.positions_patient.push_back(pixels.place(i, j, k));
    out.normals.push_back(pixels.normal(i, j, k));
    out.placed.push_back(Placed::ByLabel);
  });
  return out;
}

SignedSamples pixelSamples(const Pixels& pixels, const OrientedPoints& points) {
  SignedSamples out{points.positions_patient, std::vector<double>(points.positions_patient.size(), 0.0)};
  const volume::Grid& grid = pixels.label.grid;
  // One pixel more around: neighbours outside may lie beyond the grid.
  volume::Grid wide = grid;
  wide.dims = {grid.dims[0] + 2, grid.dims[1] + 2, grid.dims[2]};
  constexpr double kNone = std::numeric_limits<double>::infinity();
  std::vector<double> distance(wide.voxels(), kNone);
  pixels.eachBoundary([&](int i, int j, int k) {
    for (const auto& d : kAround) {
      const int ni = i + d[0], nj = j + d[1];
      if (pixels.onBoundary(ni, nj, k)) continue;
      const double length = d[0] != 0 ? grid.spacing_mm.x : grid.spacing_mm.y;
      double& held = distance[wide.index(ni + 1, nj + 1, k)];
      if (length < std::abs(held)) held = pixels.inside(ni, nj, k) ? -length : length;
    }
  });
  for (int k = 0; k < wide.dims[2]; ++k) {
    for (int j = 0; j < wide.dims[1]; ++j) {
      for (int i = 0; i < wide.dims[0]; ++i) {
        const double held = distance[wide.index(i, j, k)];
        if (held == kNone) continue;
        out.positions.push_back(pixels.place(i - 1, j - 1, k));
        out.distances_mm.push_back(held);
      }
    }
  }
  return out;
}

Result<SampledSurface> sampleLabel(const volume::LabelVolume& label, Method method) {
  const auto box = volume::boundsOf(label);
  if (!box) return tl::unexpected(box.error());
  const auto part = volume::cropTo(label, box->low, box->high);
  if (!part) return tl::unexpected(part.error());
  const Pixels pixels{*part};
  SampledSurface out;
  out.points = boundaryPixels(pixels);
  if (method == Method::Pixel) {
    out.samples = pixelSamples(pixels, out.points);
    return out;
  }
  auto samples = makeSamples(out.points);
  if (!samples) return tl::unexpected(samples.error());
  out.samples = std::move(*samples);
  return out;
}

}  // namespace

std::string_view nameOf(Method method) { return kNames[static_cast<std::size_t>(method)].second; }

std::optional<Method> methodOf(std::string_view name) {
  for (const auto& [method, known] : kNames) {
    if (known == name) return method;
  }
  return std::nullopt;
}

double meshMarginFor(Method method, double smoothing_mm) {
  return method == Method::Subvoxel && smoothing_mm <= kHeavySmoothing_mm ? kMeshMargin_mm : kWideMeshMargin_mm;
}

Result<SampledSurface> sampleSurface(const volume::CtVolume& ct, const volume::LabelVolume& label, Method method,
                                     const BoundaryOptions& options, const Progress& progress) {
  if (method != Method::Subvoxel) return sampleLabel(label, method);
  auto points = findBoundary(ct, label, options, progress);
  if (!points) return tl::unexpected(points.error());
  auto samples = makeSamples(*points);
  if (!samples) return tl::unexpected(samples.error());
  return SampledSurface{std::move(*points), std::move(*samples)};
}

}  // namespace spinaltap::surface
