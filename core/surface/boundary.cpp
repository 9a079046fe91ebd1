#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "core/surface/ct_edge.h"
#include "core/surface/neighbours.h"
#include "core/surface/smooth_label.h"
#include "core/surface/surface.h"
#include "core/volume/crop.h"

namespace spinaltap::surface {
namespace {

// What the profiles need around the label: reach, plateau and disc, in mm, on stacks of up to 1 mm or so; coarser ones
// get two more voxels below.
constexpr double kRoom_mm = 5.0;

Result<void> checkInput(const volume::CtVolume& ct, const volume::LabelVolume& label, const BoundaryOptions& o) {
  if (auto ok = volume::checkGrid(ct.grid); !ok) return ok;
  if (!(ct.grid == label.grid)) return fail(ErrorCode::InvalidArgument, "CT and label lie on different grids");
  if (ct.hu.size() != ct.grid.voxels() || label.inside.size() != ct.grid.voxels()) {
    return fail(ErrorCode::InvalidArgument, "CT or label has not one value a voxel");
  }
  if (!(o.spacing_mm >= 0.05 && o.spacing_mm <= 100)) {
    return fail(ErrorCode::InvalidArgument, "boundary point spacing must be from 0.05 to 100 mm");
  }
  if (!(o.reach_voxels >= 0 && o.reach_voxels <= 20) || !(o.minimum_contrast_hu > 0)) {
    return fail(ErrorCode::InvalidArgument, "boundary reach or contrast is out of range");
  }
  return {};
}

struct Part {
  volume::CtVolume ct;
  volume::LabelVolume label;
};

Result<Part> cropToLabel(const volume::CtVolume& ct, const volume::LabelVolume& label) {
  const auto box = volume::boundsOf(label);
  if (!box) return tl::unexpected(box.error());
  const Vec3& s = ct.grid.spacing_mm;
  const auto wide = volume::widened(*box, ct.grid, kRoom_mm + 2 * std::max({s.x, s.y, s.z}));
  auto ct_part = volume::cropTo(ct, wide.low, wide.high);
  if (!ct_part) return tl::unexpected(ct_part.error());
  auto label_part = volume::cropTo(label, wide.low, wide.high);
  if (!label_part) return tl::unexpected(label_part.error());
  return Part{std::move(*ct_part), std::move(*label_part)};
}

/// A boundary point in the making, in the grid's own axes.
struct Candidate {
  Vec3 place_mm;
  Vec3 normal;  ///< unit, outward
};

/// Slides a place near the boundary onto the smoothed label's half-way level.
std::optional<Candidate> settle(const SmoothLabel& label, Vec3 place, double longest_step) {
  Vec3 gradient;
  for (int round = 0; round < 3; ++round) {
    gradient = label.gradient(place);
    const double square = dot(gradient, gradient);
    if (!(square > 1e-6)) return std::nullopt;
    Vec3 step = gradient * ((0.5 - label.value(place)) / square);
    if (const double length = norm(step); length > longest_step) step *= longest_step / length;
    place += step;
  }
  if (std::abs(label.value(place) - 0.5) > 0.1) return std::nullopt;
  return Candidate{place, -normalized(gradient)};
}

/// Where the edges of a lattice cross the level: an even supply, whatever the voxels' shape.
std::vector<Candidate> candidatesOf(const SmoothLabel& label, double step) {
  const Vec3 low = label.low(), size = label.high() - low;
  const int nx = static_cast<int>(size.x / step) + 2, ny = static_cast<int>(size.y / step) + 2,
            nz = static_cast<int>(size.z / step) + 2;
  const auto place = [&](int i, int j, int k) { return low + Vec3{i * step, j * step, k * step}; };
  const auto index = [&](int i, int j) {
    return static_cast<std::size_t>(j) * static_cast<std::size_t>(nx) + static_cast<std::size_t>(i);
  };
  std::vector<double> layer(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny)), below;
  std::vector<Candidate> out;
  const auto cross_edge = [&](const Vec3& a, const Vec3& b, double at_a, double at_b) {
    if ((at_a > 0.5) == (at_b > 0.5)) return;
    const Vec3 start = a + (b - a) * ((0.5 - at_a) / (at_b - at_a));
    if (const auto settled = settle(label, start, step)) out.push_back(*settled);
  };
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) layer[index(i, j)] = label.value(place(i, j, k));
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        const double here = layer[index(i, j)];
        if (i > 0) cross_edge(place(i - 1, j, k), place(i, j, k), layer[index(i - 1, j)], here);
        if (j > 0) cross_edge(place(i, j - 1, k), place(i, j, k), layer[index(i, j - 1)], here);
        if (k > 0) cross_edge(place(i, j, k - 1), place(i, j, k), below[index(i, j)], here);
      }
    }
    below = layer;
  }
  return out;
}

/// Keeps candidates that are at least `spacing` from every one kept before.
std::vector<Candidate> thinned(const std::vector<Candidate>& all, double spacing) {
  std::vector<Vec3> places;
  for (const Candidate& c : all) places.push_back(c.place_mm);
  const Neighbours near(places, spacing);
  std::vector<std::uint8_t> blocked(all.size(), 0);
  std::vector<Candidate> out;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (blocked[i] != 0) continue;
    out.push_back(all[i]);
    near.eachWithin(places[i], spacing, [&](std::size_t n) { blocked[n] = 1; });
  }
  return out;
}

/// Every normal becomes the mean of those around it: voxel steps wobble them.
void smoothNormals(std::vector<Candidate>& points, double radius) {
  std::vector<Vec3> places, normals(points.size());
  for (const Candidate& c : points) places.push_back(c.place_mm);
  const Neighbours near(places, radius);
  for (std::size_t i = 0; i < points.size(); ++i) {
    near.eachWithin(places[i], radius, [&](std::size_t n) {
      if (dot(points[n].normal, points[i].normal) > 0) normals[i] += points[n].normal;
    });
  }
  for (std::size_t i = 0; i < points.size(); ++i) points[i].normal = normalized(normals[i]);
}

/// Offsets that stand out from their neighbours' median by more than half a voxel are false edges.
std::size_t dropFalseEdges(const std::vector<Candidate>& points, double radius, double tolerance,
                           std::vector<std::optional<double>>& offsets) {
  std::vector<Vec3> places;
  for (const Candidate& c : points) places.push_back(c.place_mm);
  const Neighbours near(places, radius);
  const std::vector<std::optional<double>> before = offsets;
  std::size_t kept = 0;
  std::vector<double> around;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!before[i]) continue;
    around.clear();
    near.eachWithin(places[i], radius, [&](std::size_t n) {
      if (before[n] && dot(points[n].normal, points[i].normal) > 0.5) around.push_back(*before[n]);
    });
    const auto middle = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2);
    std::nth_element(around.begin(), middle, around.end());
    if (std::abs(*before[i] - *middle) > tolerance) offsets[i] = *middle;
    ++kept;
  }
  return kept;
}

}  // namespace

Result<OrientedPoints> findBoundary(const volume::CtVolume& ct, const volume::LabelVolume& label,
                                    const BoundaryOptions& options, const Progress& progress) {
  const auto report = [&](double fraction) {
    if (progress) progress(fraction);
  };
  if (auto ok = checkInput(ct, label, options); !ok) return tl::unexpected(ok.error());
  const auto part = cropToLabel(ct, label);
  if (!part) return tl::unexpected(part.error());
  const SmoothLabel smooth(part->label);
  report(0.3);
  std::vector<Candidate> points = thinned(candidatesOf(smooth, 0.7 * options.spacing_mm), options.spacing_mm);
  if (points.size() < 4) return fail(ErrorCode::Degenerate, "the label has no boundary to speak of");
  smoothNormals(points, 1.5 * options.spacing_mm);
  report(0.5);

  std::vector<std::optional<double>> offsets;
  for (const Candidate& c : points) offsets.push_back(findCtEdge(part->ct, c.place_mm, c.normal, options));
  report(0.9);
  const Vec3& s = ct.grid.spacing_mm;
  OrientedPoints out;
  out.from_ct = dropFalseEdges(points, 3 * options.spacing_mm, 0.5 * std::max({s.x, s.y, s.z}), offsets);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 place = points[i].place_mm + points[i].normal * offsets[i].value_or(0.0);
    out.positions_patient.push_back(part->ct.grid.toPatient({place.x / s.x, place.y / s.y, place.z / s.z}));
    out.normals.push_back(ct.grid.direction * points[i].normal);
  }
  report(1.0);
  return out;
}

}  // namespace spinaltap::surface
