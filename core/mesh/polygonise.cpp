#include "core/mesh/polygonise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "core/mesh/cube_table.h"

namespace spinaltap::mesh {
namespace {

using Key = std::uint64_t;  // i, j, k of a node or a cell, 20 bits each

constexpr int kBits = 20;
constexpr int kMostCells = (1 << kBits) - 2;
constexpr std::size_t kMostNodes = 20'000'000;
constexpr double kEdgeMargin = 1e-3;     // of an edge: keeps triangles from collapsing into a node
constexpr double kRootTolerance = 1e-3;  // of a cell
constexpr int kRootRounds = 8;

struct Cell {
  int i, j, k;
};
Key keyOf(const Cell& c) {
  return (static_cast<Key>(c.k) << (2 * kBits)) | (static_cast<Key>(c.j) << kBits) | static_cast<Key>(c.i);
}
Cell cellOf(Key key) {
  const Key mask = (Key{1} << kBits) - 1;
  return {static_cast<int>(key & mask), static_cast<int>(key >> kBits & mask), static_cast<int>(key >> (2 * kBits))};
}
Cell cornerOf(const Cell& c, int corner) { return {c.i + (corner & 1), c.j + (corner >> 1 & 1), c.k + (corner >> 2)}; }

void sortUnique(std::vector<Key>& keys) {
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
}

/// A crossing: the node at its lower end and its axis, packed so that sorting is by place.
Key edgeKey(const Cell& node, int axis) { return keyOf(node) * 3 + static_cast<Key>(axis); }

class Polygoniser {
 public:
  Polygoniser(const Field& field, const PolygoniseOptions& options, const Progress& progress)
      : field_(field), options_(options), progress_(progress) {}

  Result<TriangleMesh> run(std::span<const Vec3> seeds) {
    if (auto ok = checkOptions(); !ok) return tl::unexpected(ok.error());
    if (auto ok = follow(seeds); !ok) return tl::unexpected(ok.error());
    report(0.6);
    makeTriangles();
    if (auto ok = placeVertices(); !ok) return tl::unexpected(ok.error());
    report(0.9);
    if (auto ok = placeNormals(); !ok) return tl::unexpected(ok.error());
    report(1.0);
    return std::move(mesh_);
  }

 private:
  void report(double fraction) const {
    if (progress_) progress_(fraction);
  }

  Result<void> checkOptions() {
    const Vec3 &low = options_.low_patient, &high = options_.high_patient;
    if (!isFinite(low) || !isFinite(high) || !std::isfinite(options_.cell_mm)) {
      return fail(ErrorCode::NotFinite, "polygonise box or cell is not finite");
    }
    const Vec3 size = high - low;
    if (!(options_.cell_mm > 0)) return fail(ErrorCode::InvalidArgument, "polygonise cell is not positive");
    if (!(size.x > 0 && size.y > 0 && size.z > 0)) return fail(ErrorCode::InvalidArgument, "polygonise box is empty");
    const double most = std::max({size.x, size.y, size.z}) / options_.cell_mm;
    if (most > kMostCells) return fail(ErrorCode::Limit, "polygonise box has over a million cells along one side");
    const auto count = [&](double mm) { return static_cast<int>(std::ceil(mm / options_.cell_mm)); };
    cells_ = {count(size.x), count(size.y), count(size.z)};
    return {};
  }

  [[nodiscard]] Vec3 place(const Cell& node) const {
    return options_.low_patient + Vec3{1.0 * node.i, 1.0 * node.j, 1.0 * node.k} * options_.cell_mm;
  }
  [[nodiscard]] bool holds(const Cell& c) const {
    return c.i >= 0 && c.j >= 0 && c.k >= 0 && c.i < cells_.i && c.j < cells_.j && c.k < cells_.k;
  }

  /// Cells around the seeds: their own, and where that one is not cut, its neighbours.
  Result<void> follow(std::span<const Vec3> seeds) {
    std::vector<Key> own, around;
    for (const Vec3& seed : seeds) {
      if (!isFinite(seed)) return fail(ErrorCode::NotFinite, "a polygonise seed is not finite");
      const Vec3 at = (seed - options_.low_patient) / options_.cell_mm;
      if (!(at.x >= 0 && at.y >= 0 && at.z >= 0 && at.x < cells_.i && at.y < cells_.j && at.z < cells_.k)) continue;
      own.push_back(keyOf({static_cast<int>(at.x), static_cast<int>(at.y), static_cast<int>(at.z)}));
    }
    sortUnique(own);
    if (auto ok = spread(own); !ok) return ok;
    for (const Key key : own) {
      if (maskOf(cellOf(key)) != 0 && maskOf(cellOf(key)) != 255) continue;
      const Cell c = cellOf(key);
      for (int n = 0; n < 27; ++n) {
        const Cell next{c.i + n % 3 - 1, c.j + n / 3 % 3 - 1, c.k + n / 9 - 1};
        if (holds(next)) around.push_back(keyOf(next));
      }
    }
    if (auto ok = spread(around); !ok) return ok;
    if (cut_.empty()) return fail(ErrorCode::NotFound, "no surface near any seed");
    sortUnique(cut_);
    return {};
  }

  /// Waves: evaluate all new corners of the frontier in one batch, then step over every face that the surface crosses.
  Result<void> spread(std::vector<Key> frontier) {
    while (true) {
      sortUnique(frontier);
      std::erase_if(frontier, [this](Key key) { return !visited_.insert(key).second; });
      if (frontier.empty()) return {};
      if (auto ok = evaluateCorners(frontier); !ok) return ok;
      std::vector<Key> next;
      for (const Key key : frontier) {
        const Cell c = cellOf(key);
        const int mask = maskOf(c);
        if (mask == 0 || mask == 255) continue;
        cut_.push_back(key);
        if (auto ok = stepOver(c, mask, next); !ok) return ok;
      }
      frontier = std::move(next);
      waves_ += 1;
      report(0.6 * waves_ / (waves_ + 20.0));
    }
  }

  Result<void> stepOver(const Cell& c, int mask, std::vector<Key>& next) const {
    constexpr int kFaces[6] = {0x55, 0xaa, 0x33, 0xcc, 0x0f, 0xf0};  // the corners of -x, +x, -y, +y, -z, +z
    for (int f = 0; f < 6; ++f) {
      const int on_face = mask & kFaces[f];
      if (on_face == 0 || on_face == kFaces[f]) continue;
      Cell to = c;
      (f / 2 == 0 ? to.i : f / 2 == 1 ? to.j : to.k) += f % 2 == 0 ? -1 : 1;
      if (!holds(to)) return fail(ErrorCode::InvalidArgument, "the surface leaves the polygonise box");
      next.push_back(keyOf(to));
    }
    return {};
  }

  Result<void> evaluateCorners(const std::vector<Key>& cells) {
    std::vector<Key> fresh;
    for (const Key key : cells) {
      for (int corner = 0; corner < 8; ++corner) {
        const Key node = keyOf(cornerOf(cellOf(key), corner));
        if (values_.find(node) == values_.end()) fresh.push_back(node);
      }
    }
    sortUnique(fresh);
    if (values_.size() + fresh.size() > kMostNodes) {
      return fail(ErrorCode::Limit, "the surface needs more than 20 million evaluations at this cell size");
    }
    std::vector<Vec3> points;
    points.reserve(fresh.size());
    for (const Key node : fresh) points.push_back(place(cellOf(node)));
    std::vector<double> out(points.size());
    field_.values(points, out);
    for (std::size_t i = 0; i < fresh.size(); ++i) {
      if (!std::isfinite(out[i])) return fail(ErrorCode::NotFinite, "the field is not finite inside the box");
      values_.emplace(fresh[i], out[i]);
    }
    return {};
  }

  /// Exactly zero counts as outside, everywhere alike.
  [[nodiscard]] int maskOf(const Cell& c) const {
    int mask = 0;
    for (int corner = 0; corner < 8; ++corner) {
      if (values_.at(keyOf(cornerOf(c, corner))) < 0) mask |= 1 << corner;
    }
    return mask;
  }

  /// Vertices are numbered by the place of their edges, so the mesh depends on neither seeds nor the order of visits.
  void makeTriangles() {
    const CubeTable& table = cubeTable();
    const auto each = [&](const auto& use) {
      for (const Key key : cut_) {
        const Cell c = cellOf(key);
        for (const auto& triangle : table.triangles[static_cast<std::size_t>(maskOf(c))]) use(c, triangle);
      }
    };
    const auto keyAt = [](const Cell& c, int edge) {
      const CubeEdge e = cubeEdge(edge);
      return edgeKey(cornerOf(c, e.corner), e.axis);
    };
    each([&](const Cell& c, const auto& triangle) {
      for (const int edge : triangle) edges_.push_back(keyAt(c, edge));
    });
    sortUnique(edges_);
    each([&](const Cell& c, const auto& triangle) {
      std::array<std::uint32_t, 3> t{};
      for (std::size_t n = 0; n < 3; ++n) {
        const auto at = std::lower_bound(edges_.begin(), edges_.end(), keyAt(c, triangle[n]));
        t[n] = static_cast<std::uint32_t>(at - edges_.begin());
      }
      mesh_.triangles.push_back(t);
    });
  }

  /// A bracket on one edge: t in [low, high], the values there of opposite sign.
  struct Bracket {
    Vec3 from;
    int axis;
    double low, high, at_low, at_high, t;
    int kept = 0;  ///< which end stayed put last time: +1 high, -1 low
  };

  [[nodiscard]] Vec3 pointOf(const Bracket& b) const {
    const double along = b.t * options_.cell_mm;
    return b.from + Vec3{b.axis == 0 ? along : 0, b.axis == 1 ? along : 0, b.axis == 2 ? along : 0};
  }

  /// False position with the Illinois rule (the value of an end that stays twice is halved), all edges in one batch.
  static void aim(Bracket& b) {
    const double share = b.at_low / (b.at_low - b.at_high);
    b.t = b.low + (b.high - b.low) * std::clamp(share, kEdgeMargin, 1 - kEdgeMargin);
  }

  static void narrow(Bracket& b, double value) {
    if ((value < 0) == (b.at_low < 0)) {
      b.low = b.t, b.at_low = value;
      if (b.kept == 1) b.at_high /= 2;
      b.kept = 1;
    } else {
      b.high = b.t, b.at_high = value;
      if (b.kept == -1) b.at_low /= 2;
      b.kept = -1;
    }
  }

  [[nodiscard]] Bracket bracketOf(Key edge) const {
    const int axis = static_cast<int>(edge % 3);
    const Cell node = cellOf(edge / 3);
    Cell other = node;
    (axis == 0 ? other.i : axis == 1 ? other.j : other.k) += 1;
    Bracket b{place(node), axis, 0, 1, values_.at(keyOf(node)), values_.at(keyOf(other)), 0};
    aim(b);
    return b;
  }

  Result<void> placeVertices() {
    std::vector<Bracket> brackets;
    std::vector<std::size_t> open;
    for (const Key edge : edges_) {
      open.push_back(open.size());
      brackets.push_back(bracketOf(edge));
    }
    for (int round = 0; round < kRootRounds && !open.empty(); ++round) {
      std::vector<Vec3> points;
      for (const std::size_t i : open) points.push_back(pointOf(brackets[i]));
      std::vector<double> out(points.size());
      field_.values(points, out);
      std::vector<std::size_t> still;
      for (std::size_t n = 0; n < open.size(); ++n) {
        if (!std::isfinite(out[n])) return fail(ErrorCode::NotFinite, "the field is not finite inside the box");
        if (std::abs(out[n]) <= kRootTolerance * options_.cell_mm) continue;
        narrow(brackets[open[n]], out[n]);
        aim(brackets[open[n]]);
        still.push_back(open[n]);
      }
      open = std::move(still);
    }
    for (Bracket& b : brackets) {
      b.t = std::clamp(b.t, kEdgeMargin, 1 - kEdgeMargin);
      mesh_.vertices.push_back(pointOf(b));
    }
    return {};
  }

  Result<void> placeNormals() {
    mesh_.normals.resize(mesh_.vertices.size());
    field_.gradients(mesh_.vertices, mesh_.normals);
    std::vector<Vec3> from_triangles(mesh_.vertices.size());
    for (const auto& t : mesh_.triangles) {
      const Vec3& a = mesh_.vertices[t[0]];
      const Vec3 area = cross(mesh_.vertices[t[1]] - a, mesh_.vertices[t[2]] - a);
      for (const std::uint32_t v : t) from_triangles[v] += area;
    }
    for (std::size_t v = 0; v < mesh_.normals.size(); ++v) {
      Vec3& n = mesh_.normals[v];
      if (!isFinite(n)) return fail(ErrorCode::NotFinite, "the field's gradient is not finite");
      if (!(norm(n) > 1e-9)) n = from_triangles[v];
      n = norm(n) > 0 ? normalized(n) : Vec3{0, 0, 1};
    }
    return {};
  }

  const Field& field_;
  const PolygoniseOptions& options_;
  const Progress& progress_;
  Cell cells_{0, 0, 0};
  double waves_ = 0;
  std::unordered_map<Key, double> values_;  ///< at the nodes
  std::unordered_set<Key> visited_;         ///< cells
  std::vector<Key> cut_;                    ///< cells that the surface crosses
  std::vector<Key> edges_;                  ///< crossings, sorted: one vertex each
  TriangleMesh mesh_;
};

}  // namespace

Result<TriangleMesh> polygonise(const Field& field, std::span<const Vec3> seeds_patient,
                                const PolygoniseOptions& options, const Progress& progress) {
  return Polygoniser(field, options, progress).run(seeds_patient);
}

}  // namespace spinaltap::mesh
