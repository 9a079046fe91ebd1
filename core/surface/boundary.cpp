#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "core/base/parallel.h"
#include "core/surface/candidates.h"
#include "core/surface/local_shape.h"
#include "core/surface/neighbours.h"
#include "core/surface/scanner.h"
#include "core/surface/shell_edge.h"
#include "core/surface/surface.h"
#include "core/volume/crop.h"

namespace spinaltap::surface {
namespace {

// What the profiles need around the label: reach, plateau and disc, in mm, on stacks of up to 1 mm or so; coarser ones
// get two more voxels below.
constexpr double kRoom_mm = 5.0;
constexpr std::size_t kBlock = 64;  // points a thread takes at once
// A quadric that turns a normal by more than 60 degrees has been misled, by a thin tip or by too few points.
constexpr double kTrustedTurn = 0.5;

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

struct Outline {
  SmoothLabel label;
  std::vector<Candidate> points;
};

Result<Outline> findOutline(const volume::LabelVolume& label, double spacing_mm) {
  const auto with = [&](double blur_voxels) {
    SmoothLabel smooth(label, blur_voxels);
    auto points = candidatesOn(smooth, spacing_mm);
    return Outline{std::move(smooth), std::move(points)};
  };
  Outline found = with(SmoothLabel::kBlur_voxels);
  if (found.points.size() < 4) found = with(SmoothLabel::kFaintBlur_voxels);
  if (found.points.size() < 4) {
    return fail(ErrorCode::Degenerate,
                "the label has no boundary to speak of: " + std::to_string(found.points.size()) + " points");
  }
  return found;
}

std::vector<Vec3> placesOf(const std::vector<Candidate>& points) {
  std::vector<Vec3> out;
  out.reserve(points.size());
  for (const Candidate& c : points) out.push_back(c.place_mm);
  return out;
}

/// Normals of the quadrics through the points as they lie now.
void takeLocalNormals(std::vector<Candidate>& points, double radius) {
  const std::vector<Vec3> places = placesOf(points);
  std::vector<Vec3> normals;
  normals.reserve(points.size());
  for (const Candidate& c : points) normals.push_back(c.normal);
  const Neighbours near(places, radius);
  parallelBlocks(points.size(), kBlock, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (points[i].cut) continue;
      const Vec3 normal = shapeAround({places, normals, &near}, i, radius).normal;
      if (dot(normal, normals[i]) > kTrustedTurn) points[i].normal = normal;
    }
  });
}

// An edge that differs from its neighbours by more is another one.
constexpr double kFalse_mm = 0.25, kFalse_voxels = 0.25;

using Offsets = std::vector<std::optional<double>>;

Offsets offsetsOf(const volume::CtVolume& ct, const Outline& outline, const Scanner& scanner,
                  const BoundaryOptions& options) {
  const std::vector<Candidate>& points = outline.points;
  Offsets out(points.size());
  parallelBlocks(points.size(), kBlock, 0, [&](std::size_t begin, std::size_t end) {
    std::vector<double> hu;
    for (std::size_t i = begin; i < end; ++i) {
      if (points[i].cut) continue;
      const EdgeQuery query = queryAt(outline.label, ct.grid, scanner, points[i], options);
      if (const auto edge = findShellEdge(sampleProfile(ct, points[i], query, hu), query)) out[i] = edge->edge_mm;
    }
  });
  return out;
}

struct Move {
  double offset_mm = 0;
  Placed by = Placed::ByLabel;
};

/// The CT's edge, unless it stands out from its neighbours' median by more than `tolerance`: then, and where there is
/// none, the median itself.
std::vector<Move> settledMoves(const std::vector<Candidate>& points, const Offsets& offsets, double radius,
                               double tolerance) {
  constexpr std::size_t kFewest = 3;
  const std::vector<Vec3> places = placesOf(points);
  const Neighbours near(places, radius);
  std::vector<Move> out(points.size());
  parallelBlocks(points.size(), kBlock, 0, [&](std::size_t begin, std::size_t end) {
    std::vector<double> around;
    for (std::size_t i = begin; i < end; ++i) {
      if (points[i].cut) {
        out[i].by = Placed::ByVolume;
        continue;
      }
      around.clear();
      near.eachWithin(places[i], radius, [&](std::size_t n) {
        if (offsets[n] && dot(points[n].normal, points[i].normal) > 0.5) around.push_back(*offsets[n]);
      });
      if (around.size() < kFewest) continue;
      const auto middle = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2);
      std::nth_element(around.begin(), middle, around.end());
      const bool own = offsets[i] && std::abs(*offsets[i] - *middle) <= tolerance;
      out[i] = own ? Move{*offsets[i], Placed::ByCt} : Move{*middle, Placed::ByNeighbours};
    }
  });
  return out;
}

OrientedPoints inPatient(const volume::Grid& grid, const std::vector<Candidate>& points, const std::vector<Move>& moves,
                         const Scanner& scanner) {
  OrientedPoints out;
  out.scanner = scanner;
  const Vec3& s = grid.spacing_mm;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3& place = points[i].place_mm;
    out.positions_patient.push_back(grid.toPatient({place.x / s.x, place.y / s.y, place.z / s.z}));
    out.normals.push_back(grid.direction * points[i].normal);
    out.placed.push_back(moves[i].by);
    out.from_ct += moves[i].by == Placed::ByCt ? 1 : 0;
  }
  return out;
}

/// A move along a normal must not leave the volume, whose faces are the surface where bone reaches them.
Vec3 keptWithin(const volume::Grid& grid, const Vec3& place) {
  const Vec3& s = grid.spacing_mm;
  const auto kept = [](double at, double spacing, int count) {
    return std::clamp(at, -0.5 * spacing, (count - 0.5) * spacing);
  };
  return {kept(place.x, s.x, grid.dims[0]), kept(place.y, s.y, grid.dims[1]), kept(place.z, s.z, grid.dims[2])};
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
  report(0.05);
  auto outline = findOutline(part->label, options.spacing_mm);
  if (!outline) return tl::unexpected(outline.error());
  std::vector<Candidate>& points = outline->points;
  const Vec3& s = ct.grid.spacing_mm;
  const double longest = std::max({s.x, s.y, s.z});
  const double radius = std::max({kNormalRadius_mm, 2.5 * options.spacing_mm, 1.25 * longest});
  takeLocalNormals(points, std::max(radius, longest));
  report(0.4);
  const Scanner scanner = estimateScanner(part->ct, outline->label, points, options);
  report(0.6);
  const Offsets offsets = offsetsOf(part->ct, *outline, scanner, options);
  report(0.9);
  std::vector<Move> moves =
      settledMoves(points, offsets, 3 * options.spacing_mm, std::max(kFalse_mm, kFalse_voxels * longest));
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].place_mm = keptWithin(part->ct.grid, points[i].place_mm + points[i].normal * moves[i].offset_mm);
  }
  takeLocalNormals(points, radius);
  report(1.0);
  return inPatient(part->ct.grid, points, moves, scanner);
}

}  // namespace spinaltap::surface
