#include "server/mesh_out/simplify.h"

#include <meshoptimizer.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <limits>
#include <string>

#include "core/mesh/pinches.h"
#include "server/mesh_out/within.h"

namespace spinaltap::mesh_out {
namespace {

using mesh::TriangleMesh;
using Triangles = std::vector<std::array<std::uint32_t, 3>>;

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
// The library's error is about a root mean square; on bone half of what is allowed leaves few places beyond it.
constexpr double kFirst = 0.5, kTighter = 0.7, kLast = 0.01;
constexpr int kMostRounds = 16;
constexpr double kMostKept = 0.1;  // of all triangles

class Simplifier {
 public:
  Simplifier(const TriangleMesh& mesh, double max_error_mm)
      : mesh_(mesh), max_error_mm_(max_error_mm), grid_(mesh, max_error_mm) {
    const Vec3& origin = mesh.vertices.front();
    for (const Vec3& v : mesh.vertices) {
      for (const double along : {v.x - origin.x, v.y - origin.y, v.z - origin.z}) {
        positions_.push_back(static_cast<float>(along));
      }
    }
    scale_ = meshopt_simplifyScale(positions_.data(), mesh.vertices.size(), kStride);
    listTrianglesOfVertices();
  }

  /// Faults are mended where they are, by keeping the old triangles there; if there are too many for that to pay, by
  /// asking the library for less.
  TriangleMesh run() {
    for (double error_mm = kFirst * max_error_mm_; error_mm > kLast * max_error_mm_; error_mm *= kTighter) {
      keep_.assign(mesh_.triangles.size(), false);
      for (int round = 0; round < kMostRounds; ++round) {
        TriangleMesh made = simplified(error_mm);
        const std::size_t kept_before = kept();
        keepAround(faultsOf(made));
        if (kept() == kept_before) return compacted(made);
        if (static_cast<double>(kept()) > kMostKept * static_cast<double>(mesh_.triangles.size())) break;
      }
    }
    return mesh_;
  }

 private:
  static constexpr std::size_t kStride = 3 * sizeof(float);

  [[nodiscard]] std::size_t kept() const {
    return static_cast<std::size_t>(std::count(keep_.begin(), keep_.end(), true));
  }

  void listTrianglesOfVertices() {
    first_.assign(mesh_.vertices.size() + 1, 0);
    for (const auto& t : mesh_.triangles) {
      for (const std::uint32_t v : t) ++first_[v + 1];
    }
    for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) first_[v + 1] += first_[v];
    around_.resize(first_.back());
    std::vector<std::uint32_t> at(first_.begin(), first_.end() - 1);
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      for (const std::uint32_t v : mesh_.triangles[t]) around_[at[v]++] = t;
    }
  }

  /// All triangles but the kept ones, whose borders the library leaves alone, and those as they are.
  [[nodiscard]] TriangleMesh simplified(double error_mm) const {
    std::vector<std::uint32_t> indices;
    TriangleMesh made{mesh_.vertices, {}, {}};
    for (std::size_t t = 0; t < keep_.size(); ++t) {
      const auto& v = mesh_.triangles[t];
      if (keep_[t]) {
        made.triangles.push_back(v);
      } else {
        indices.insert(indices.end(), v.begin(), v.end());
      }
    }
    std::vector<std::uint32_t> out(indices.size());
    out.resize(meshopt_simplify(out.data(), indices.data(), indices.size(), positions_.data(), mesh_.vertices.size(),
                                kStride, 0, static_cast<float>(error_mm / scale_), meshopt_SimplifyLockBorder,
                                nullptr));
    for (std::size_t i = 0; i < out.size(); i += 3) made.triangles.push_back({out[i], out[i + 1], out[i + 2]});
    return made;
  }

  /// The library may fold a thin triangle over; then it faces against what its corners were part of.
  [[nodiscard]] bool isFolded(const std::array<std::uint32_t, 3>& t) const {
    const Vec3& a = mesh_.vertices[t[0]];
    const Vec3 facing = cross(mesh_.vertices[t[1]] - a, mesh_.vertices[t[2]] - a);
    return !(dot(facing, mesh_.normals[t[0]] + mesh_.normals[t[1]] + mesh_.normals[t[2]]) > 0);
  }

  /// Old vertices where the made mesh is not manifold or folded; where it is neither, where one surface is too far from
  /// the other, which takes ten times as long to tell.
  [[nodiscard]] std::vector<std::uint32_t> faultsOf(const TriangleMesh& made) {
    std::vector<std::uint32_t> all(mesh_.vertices.size());
    for (std::uint32_t v = 0; v < all.size(); ++v) all[v] = v;
    if (made.triangles.empty()) return all;
    std::vector<std::uint32_t> faults = mesh::pinchedVertices(made, all);
    const auto add = [&](const std::array<std::uint32_t, 3>& t) { faults.insert(faults.end(), t.begin(), t.end()); };
    for (const auto& t : made.triangles) {
      if (isFolded(t)) add(t);
    }
    if (growsKept(faults)) return faults;
    for (const auto& t : farFromTheOld(made)) add(t);
    const TriangleGrid made_grid(made, max_error_mm_);
    for (const std::uint32_t t : farTriangles(mesh_, made_grid, max_error_mm_)) add(mesh_.triangles[t]);
    return faults;
  }

  /// Only those that no round before has had: most triangles come again, and the old mesh stays.
  [[nodiscard]] Triangles farFromTheOld(const TriangleMesh& made) {
    Triangles all = made.triangles;
    for (auto& t : all) std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    std::sort(all.begin(), all.end());
    TriangleMesh fresh{mesh_.vertices, {}, {}};
    std::set_difference(all.begin(), all.end(), near_.begin(), near_.end(), std::back_inserter(fresh.triangles));
    Triangles far, near_too;
    for (const std::uint32_t t : farTriangles(fresh, grid_, max_error_mm_)) far.push_back(fresh.triangles[t]);
    std::set_difference(fresh.triangles.begin(), fresh.triangles.end(), far.begin(), far.end(),
                        std::back_inserter(near_too));
    Triangles merged;
    std::merge(near_.begin(), near_.end(), near_too.begin(), near_too.end(), std::back_inserter(merged));
    near_ = std::move(merged);
    return far;
  }

  /// Whether a triangle at these vertices is not kept yet. An old mesh's own faults are left as they are.
  [[nodiscard]] bool growsKept(const std::vector<std::uint32_t>& vertices) const {
    return std::any_of(vertices.begin(), vertices.end(), [this](std::uint32_t v) {
      return std::any_of(around_.begin() + first_[v], around_.begin() + first_[v + 1],
                         [this](std::uint32_t t) { return !keep_[t]; });
    });
  }

  void keepAround(const std::vector<std::uint32_t>& vertices) {
    for (const std::uint32_t v : vertices) {
      for (std::uint32_t n = first_[v]; n < first_[v + 1]; ++n) {
        for (const std::uint32_t next : mesh_.triangles[around_[n]]) {
          for (std::uint32_t m = first_[next]; m < first_[next + 1]; ++m) keep_[around_[m]] = true;
        }
      }
    }
  }

  [[nodiscard]] TriangleMesh compacted(const TriangleMesh& made) const {
    std::vector<std::uint32_t> number(mesh_.vertices.size(), kNone);
    for (const auto& t : made.triangles) {
      for (const std::uint32_t v : t) number[v] = 0;
    }
    TriangleMesh out;
    for (std::size_t v = 0; v < number.size(); ++v) {
      if (number[v] == kNone) continue;
      number[v] = static_cast<std::uint32_t>(out.vertices.size());
      out.vertices.push_back(mesh_.vertices[v]);
      out.normals.push_back(mesh_.normals[v]);
    }
    for (const auto& t : made.triangles) out.triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
    return out;
  }

  const TriangleMesh& mesh_;
  double max_error_mm_, scale_ = 1;
  TriangleGrid grid_;
  std::vector<float> positions_;               ///< #V by 3, from the first vertex
  std::vector<std::uint32_t> first_, around_;  ///< triangles at each vertex
  Triangles near_;                             ///< proved to be near the old mesh; sorted, lowest vertex first
  std::vector<bool> keep_;                     ///< #T: as they are
};

}  // namespace

Result<TriangleMesh> simplify(const TriangleMesh& mesh, double max_error_mm) {
  if (!(max_error_mm >= kLeastError_mm && max_error_mm <= kMostError_mm)) {
    return fail(ErrorCode::InvalidArgument,
                "the error of a simplified mesh is between 0.001 and 10 mm, not " + std::to_string(max_error_mm));
  }
  if (mesh.triangles.empty()) return mesh;
  return Simplifier(mesh, max_error_mm).run();
}

}  // namespace spinaltap::mesh_out
