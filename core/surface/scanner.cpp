#include "core/surface/scanner.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/base/parallel.h"
#include "core/volume/sample.h"

namespace spinaltap::surface {
namespace {

// Profiles are averaged over a small disc: a third of the noise goes, and on a rounding of 3 mm radius the disc's
// sagitta is below 0.03 mm.
constexpr double kDisc_mm = 0.4;
constexpr double kWallStep_mm = 0.4;  // the far wall of a plate is sought in such steps
constexpr double kFinestStep_mm = 0.1, kStepOfBlur = 1.0 / 3.0;

// A sharp scanner's third of a millimetre of full width, besides the voxels'.
constexpr double kSharpestBlur_mm = 0.15;
// Before a scan has been looked at: cortical bone of any density that bone has. Afterwards no less than this: a thin
// cortex that is blurred looks like a less dense one.
constexpr double kLikelyCortical_hu = 800, kAnySpread_hu = 400;
// In one bone it differs from place to place, most between body and arch.
constexpr double kCorticalSpread_hu = 150;
constexpr std::size_t kProfiles = 1200;
constexpr int kRounds = 2;
// A profile that tells something about the blur: a strong edge which the model describes.
constexpr double kStrongEdge_hu = 300, kMisfit_hu = 80;
constexpr double kAlongAxis = 0.8;  // cosine squared
// Blur, thickness and density of a thin cortex can be exchanged for one another; of one three times as thick as the
// blur they cannot. Where there are too few of those, thinner ones have to do.
constexpr double kThick_blurs[] = {3.0, 2.0, 0.0};
constexpr std::size_t kEnough = 12;

std::array<Vec3, 7> discAcross(const Vec3& normal) {
  const Vec3 helper = std::abs(normal.x) < 0.6 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 u = normalized(cross(normal, helper)), v = cross(normal, u);
  std::array<Vec3, 7> out{};
  constexpr double kCos60 = 0.5, kSin60 = 0.8660254037844386;
  const double around[6][2] = {{1, 0},  {kCos60, kSin60},   {-kCos60, kSin60},
                               {-1, 0}, {-kCos60, -kSin60}, {kCos60, -kSin60}};
  for (std::size_t i = 0; i < 6; ++i) out[i + 1] = (u * around[i][0] + v * around[i][1]) * kDisc_mm;
  return out;
}

/// The value below which this share of them lies; `values` are reordered. @pre not empty.
double quantile(std::vector<double>& values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Linear interpolation between samples h apart spreads them by a triangle of variance h^2/6.
double leastBlur(double h) { return std::sqrt(h * h / 6 + kSharpestBlur_mm * kSharpestBlur_mm); }

Scanner firstGuess(const volume::Grid& grid) {
  const Vec3& s = grid.spacing_mm;
  return {{leastBlur(s.x), leastBlur(s.y), leastBlur(s.z)}, kLikelyCortical_hu, 0};
}

struct Told {
  Vec3 normal;
  ShellEdge edge;
};

std::vector<Told> askSome(const volume::CtVolume& ct, const SmoothLabel& label, std::span<const Candidate> candidates,
                          const Scanner& scanner, const BoundaryOptions& options) {
  const std::size_t stride = std::max<std::size_t>(1, candidates.size() / kProfiles);
  const std::size_t count = (candidates.size() + stride - 1) / stride;
  std::vector<std::optional<ShellEdge>> edges(count);
  parallelBlocks(count, 32, 0, [&](std::size_t begin, std::size_t end) {
    std::vector<double> hu;
    for (std::size_t n = begin; n < end; ++n) {
      const Candidate& c = candidates[n * stride];
      if (c.cut) continue;
      EdgeQuery query = queryAt(label, ct.grid, scanner, c, options);
      const Profile profile = sampleProfile(ct, c, query, hu);
      query.free_blur = true, query.cortical_hu = kLikelyCortical_hu, query.cortical_spread_hu = kAnySpread_hu;
      edges[n] = findShellEdge(profile, query);
    }
  });
  std::vector<Told> out;
  for (std::size_t n = 0; n < count; ++n) {
    const auto& e = edges[n];
    if (!e || e->peak_hu - e->outside_hu < kStrongEdge_hu || e->misfit_hu > kMisfit_hu) continue;
    out.push_back({candidates[n * stride].normal, *e});
  }
  return out;
}

/// The median of what the thickest cortices tell, of those that `counts` lets pass.
template <class Counts, class Value>
double medianOf(const std::vector<Told>& told, double otherwise, const Counts& counts, const Value& value) {
  std::vector<double> values;
  for (const double blurs : kThick_blurs) {
    values.clear();
    for (const Told& t : told) {
      if (counts(t) && t.edge.thickness_mm >= blurs * t.edge.blur_mm) values.push_back(value(t.edge));
    }
    if (values.size() >= kEnough) return quantile(values, 0.5);
  }
  return otherwise;
}

}  // namespace

double voxelAlong(const volume::Grid& grid, const Vec3& n) {
  const Vec3& s = grid.spacing_mm;
  return norm({n.x * s.x, n.y * s.y, n.z * s.z});
}

double blurAlong(const Scanner& scanner, const Vec3& n) {
  const Vec3& b = scanner.blur_mm;
  return norm({n.x * b.x, n.y * b.y, n.z * b.z});
}

EdgeQuery queryAt(const SmoothLabel& label, const volume::Grid& grid, const Scanner& scanner, const Candidate& c,
                  const BoundaryOptions& options) {
  EdgeQuery query;
  query.reach_mm = options.reach_voxels * voxelAlong(grid, c.normal);
  query.blur_mm = blurAlong(scanner, c.normal);
  query.cortical_hu = scanner.cortical_hu;
  query.cortical_spread_hu = kCorticalSpread_hu;
  query.least_fall_hu = options.minimum_contrast_hu;
  const double farthest = query.reach_mm + plateauOf(query);
  for (double depth = kWallStep_mm; depth <= 2 * farthest; depth += kWallStep_mm) {
    if (label.value(c.place_mm - c.normal * depth) > 0.5) continue;
    query.most_inside_mm = 0.5 * depth;
    break;
  }
  return query;
}

Profile sampleProfile(const volume::CtVolume& ct, const Candidate& c, const EdgeQuery& query, std::vector<double>& hu) {
  const double step = std::max(kFinestStep_mm, kStepOfBlur * query.blur_mm);
  const double half = query.reach_mm + plateauOf(query);
  const auto each_way = static_cast<std::size_t>(std::ceil(half / step));
  const std::size_t count = 2 * each_way + 1;
  const double first = -step * static_cast<double>(each_way);
  const std::array<Vec3, 7> disc = discAcross(c.normal);
  const Vec3& s = ct.grid.spacing_mm;
  hu.assign(count, 0.0);
  for (std::size_t n = 0; n < count; ++n) {
    const Vec3 middle = c.place_mm + c.normal * (first + step * static_cast<double>(n));
    for (const Vec3& d : disc) {
      const Vec3 p = middle + d;
      hu[n] += volume::sampleHuAtVoxel(ct, {p.x / s.x, p.y / s.y, p.z / s.z});
    }
    hu[n] /= static_cast<double>(disc.size());
  }
  return {hu, first, step};
}

Scanner estimateScanner(const volume::CtVolume& ct, const SmoothLabel& label, std::span<const Candidate> candidates,
                        const BoundaryOptions& options) {
  Scanner scanner = firstGuess(ct.grid);
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<Told> told = askSome(ct, label, candidates, scanner, options);
    scanner.profiles = told.size();
    if (told.empty()) break;
    const auto blur = [&](double Vec3::* axis) {
      return medianOf(
          told, scanner.blur_mm.*axis, [&](const Told& t) { return t.normal.*axis * t.normal.*axis > kAlongAxis; },
          [](const ShellEdge& e) { return e.blur_mm; });
    };
    const double cortical = medianOf(
        told, scanner.cortical_hu, [](const Told&) { return true; }, [](const ShellEdge& e) { return e.cortical_hu; });
    scanner.cortical_hu = std::max(kLikelyCortical_hu, cortical);
    const Vec3& s = ct.grid.spacing_mm;
    scanner.blur_mm = {std::max(blur(&Vec3::x), leastBlur(s.x)), std::max(blur(&Vec3::y), leastBlur(s.y)),
                       std::max(blur(&Vec3::z), leastBlur(s.z))};
  }
  return scanner;
}

}  // namespace spinaltap::surface
