#include "server/mesh_out/within.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/parallel.h"

namespace spinaltap::mesh_out {
namespace {

constexpr std::size_t kMostCubes = 1 << 24;

Vec3 lower(const Vec3& a, const Vec3& b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }

double squaredNorm(const Vec3& v) { return dot(v, v); }

/// Corners, and a triangle that was near the piece it was cut from.
struct Piece {
  std::array<Vec3, 3> corner;
  std::uint32_t hint;
};

class Prover {
 public:
  Prover(const TriangleGrid& other, double reach_mm) : other_(other), least_mm2_(reach_mm * reach_mm * 1e-6) {}

  bool isNear(const std::array<Vec3, 3>& triangle) {
    pieces_.assign(1, {triangle, hint_});
    while (!pieces_.empty()) {
      const Piece piece = pieces_.back();
      pieces_.pop_back();
      const std::uint32_t near_it = other_.nearPiece(piece.corner, piece.hint);
      if (near_it != TriangleGrid::kNone) {
        hint_ = near_it;
        continue;
      }
      if (!split(piece)) return false;
    }
    return true;
  }

 private:
  /// In halves, across the longest edge. False when the piece is hopeless: its corner is far, or it is too small.
  bool split(const Piece& piece) {
    std::size_t longest = 0;
    double most = -1;
    for (std::size_t n = 0; n < 3; ++n) {
      const double length = squaredNorm(piece.corner[(n + 1) % 3] - piece.corner[n]);
      if (length > most) most = length, longest = n;
    }
    if (most < least_mm2_) return false;
    const Vec3 &a = piece.corner[longest], &b = piece.corner[(longest + 1) % 3], &c = piece.corner[(longest + 2) % 3];
    const Vec3 middle = (a + b) / 2;
    const std::uint32_t near_middle = other_.nearPoint(middle, piece.hint);
    if (near_middle == TriangleGrid::kNone) return false;
    pieces_.push_back({{a, middle, c}, near_middle});
    pieces_.push_back({{middle, b, c}, near_middle});
    return true;
  }

  const TriangleGrid& other_;
  double least_mm2_;
  std::uint32_t hint_ = TriangleGrid::kNone;
  std::vector<Piece> pieces_;
};

}  // namespace

double squaredDistance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return squaredNorm(ap);
  const Vec3 bp = p - b;
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return squaredNorm(bp);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return squaredNorm(ap - ab * (d1 / (d1 - d3)));
  const Vec3 cp = p - c;
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return squaredNorm(cp);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return squaredNorm(ap - ac * (d2 / (d2 - d6)));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return squaredNorm(bp - (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6))));
  }
  const double sum = va + vb + vc;
  return squaredNorm(ap - ab * (vb / sum) - ac * (vc / sum));
}

TriangleGrid::TriangleGrid(const mesh::TriangleMesh& mesh, double reach_mm) : mesh_(mesh), reach_mm_(reach_mm) {
  Vec3 high = mesh.vertices.front();
  low_ = high;
  for (const Vec3& v : mesh.vertices) low_ = lower(low_, v), high = -lower(-high, -v);
  low_ -= Vec3{1, 1, 1} * reach_mm, high += Vec3{1, 1, 1} * reach_mm;
  double edges = 0;
  for (const auto& t : mesh.triangles) {
    const double edge = norm(mesh.vertices[t[1]] - mesh.vertices[t[0]]);
    edges += edge, most_radius_mm_ = std::max({most_radius_mm_, edge, norm(mesh.vertices[t[2]] - mesh.vertices[t[0]])});
  }
  most_radius_mm_ += reach_mm;
  side_mm_ = std::max(reach_mm, edges / static_cast<double>(mesh.triangles.size()));
  const Vec3 size = high - low_;
  // Whatever the scale, the cubes fit into memory.
  side_mm_ = std::max(side_mm_, std::max({size.x, size.y, size.z}) / std::cbrt(double(kMostCubes)));
  const auto count = [&](double mm) { return static_cast<std::size_t>(mm / side_mm_) + 1; };
  cubes_ = {count(size.x), count(size.y), count(size.z)};

  // Each triangle stands in every cube that its box, widened by the reach, meets: a point asks its own cube alone.
  const auto eachCube = [&](std::uint32_t t, const auto& use) {
    const auto& v = mesh.triangles[t];
    const Vec3 &a = mesh.vertices[v[0]], &b = mesh.vertices[v[1]], &c = mesh.vertices[v[2]];
    const Vec3 reach = Vec3{1, 1, 1} * reach_mm_;
    const Vec3 from = lower(a, lower(b, c)) - reach - low_, to = -lower(-a, lower(-b, -c)) + reach - low_;
    const auto cube = [&](double mm) { return static_cast<std::size_t>(std::max(0.0, mm / side_mm_)); };
    for (std::size_t z = cube(from.z); z <= std::min(cube(to.z), cubes_[2] - 1); ++z)
      for (std::size_t y = cube(from.y); y <= std::min(cube(to.y), cubes_[1] - 1); ++y)
        for (std::size_t x = cube(from.x); x <= std::min(cube(to.x), cubes_[0] - 1); ++x)
          use((z * cubes_[1] + y) * cubes_[0] + x);
  };
  first_.assign(cubes_[0] * cubes_[1] * cubes_[2] + 1, 0);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) eachCube(t, [&](std::size_t cube) { ++first_[cube + 1]; });
  for (std::size_t cube = 0; cube + 1 < first_.size(); ++cube) first_[cube + 1] += first_[cube];
  triangles_.resize(first_.back());
  std::vector<std::uint32_t> at(first_.begin(), first_.end() - 1);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    eachCube(t, [&](std::size_t cube) { triangles_[at[cube]++] = t; });
  }
}

double TriangleGrid::squaredDistanceTo(std::uint32_t triangle, const Vec3& point) const {
  const auto& v = mesh_.triangles[triangle];
  return squaredDistance(point, mesh_.vertices[v[0]], mesh_.vertices[v[1]], mesh_.vertices[v[2]]);
}

std::span<const std::uint32_t> TriangleGrid::candidates(const Vec3& point) const {
  const Vec3 at = (point - low_) / side_mm_;
  if (!(at.x >= 0 && at.y >= 0 && at.z >= 0)) return {};
  if (!(at.x < double(cubes_[0]) && at.y < double(cubes_[1]) && at.z < double(cubes_[2]))) return {};
  const std::size_t cube = (static_cast<std::size_t>(at.z) * cubes_[1] + static_cast<std::size_t>(at.y)) * cubes_[0] +
                           static_cast<std::size_t>(at.x);
  return std::span(triangles_).subspan(first_[cube], first_[cube + 1] - first_[cube]);
}

std::uint32_t TriangleGrid::nearPiece(const std::array<Vec3, 3>& piece, std::uint32_t hint) const {
  const Vec3 middle = (piece[0] + piece[1] + piece[2]) / 3;
  double radius2 = 0;
  for (const Vec3& corner : piece) radius2 = std::max(radius2, squaredNorm(corner - middle));
  const double room_mm = std::max(0.0, reach_mm_ - std::sqrt(radius2));
  const auto shows = [&](std::uint32_t t) {
    const double distance2 = squaredDistanceTo(t, middle);
    if (distance2 < room_mm * room_mm) return true;
    const double reach2 = reach_mm_ * reach_mm_;
    return distance2 <= reach2 && squaredDistanceTo(t, piece[0]) <= reach2 &&
           squaredDistanceTo(t, piece[1]) <= reach2 && squaredDistanceTo(t, piece[2]) <= reach2;
  };
  if (hint != kNone && shows(hint)) return hint;
  // Too large to lie along any one triangle.
  if (radius2 > most_radius_mm_ * most_radius_mm_) return kNone;
  for (const std::uint32_t t : candidates(middle)) {
    if (shows(t)) return t;
  }
  return kNone;
}

std::uint32_t TriangleGrid::nearPoint(const Vec3& point, std::uint32_t hint) const {
  const double reach2 = reach_mm_ * reach_mm_;
  if (hint != kNone && squaredDistanceTo(hint, point) <= reach2) return hint;
  for (const std::uint32_t t : candidates(point)) {
    if (squaredDistanceTo(t, point) <= reach2) return t;
  }
  return kNone;
}

std::vector<std::uint32_t> farTriangles(const mesh::TriangleMesh& mesh, const TriangleGrid& other, double reach_mm) {
  std::vector<std::uint8_t> far(mesh.triangles.size(), 0);
  parallelBlocks(mesh.triangles.size(), 256, 0, [&](std::size_t begin, std::size_t end) {
    Prover prover(other, reach_mm);
    for (std::size_t t = begin; t < end; ++t) {
      const auto& v = mesh.triangles[t];
      far[t] = prover.isNear({mesh.vertices[v[0]], mesh.vertices[v[1]], mesh.vertices[v[2]]}) ? 0 : 1;
    }
  });
  std::vector<std::uint32_t> out;
  for (std::uint32_t t = 0; t < far.size(); ++t) {
    if (far[t] != 0) out.push_back(t);
  }
  return out;
}

}  // namespace spinaltap::mesh_out
