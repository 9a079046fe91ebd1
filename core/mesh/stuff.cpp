#include "core/mesh/stuff.h"

#include <algorithm>
#include <array>
#include <utility>

namespace spinaltap::mesh {
namespace {

enum class State : std::uint8_t { Inside, OnIt, Outside };  // of a node; moved nodes are on the surface

/// What stands inside a tetrahedron: a polygon of corners (0-3) and edges (4 + number in kTetEdge), counter-clockwise
/// seen from outside. Faces of three moved nodes are not inside: see fillFace.
struct Polygon {
  std::array<int, 4> at{};
  int count = 0;
};

/// The faces, each against its corner, counter-clockwise seen from beyond it.
constexpr std::array<std::array<std::size_t, 3>, 4> kFaceAgainst{{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

int edgeCode(int a, int b) {
  for (std::size_t e = 0; e < kTetEdge.size(); ++e) {
    if (kTetEdge[e] == std::array{std::min(a, b), std::max(a, b)}) return 4 + static_cast<int>(e);
  }
  return -1;
}

Vec3 middleOf(const std::vector<int>& corners) {
  Vec3 sum;
  for (const int c : corners) {
    const Node& n = kTets[0].corner[static_cast<std::size_t>(c)];
    sum += Vec3{1.0 * n.x, 1.0 * n.y, 1.0 * n.z};
  }
  return sum / static_cast<double>(corners.size());
}
Vec3 placeOf(int code) {
  if (code < 4) return middleOf({code});
  const auto& ends = kTetEdge[static_cast<std::size_t>(code - 4)];
  return middleOf({ends[0], ends[1]});
}

Polygon polygonOf(const std::array<State, 4>& states) {
  std::vector<int> in, on, out;
  for (int c = 0; c < 4; ++c) {
    const State s = states[static_cast<std::size_t>(c)];
    (s == State::Inside ? in : s == State::OnIt ? on : out).push_back(c);
  }
  std::vector<int> codes = on;
  Polygon polygon;
  if (in.empty() || out.empty()) return polygon;
  if (in.size() == 2 && out.size() == 2) {
    codes = {edgeCode(in[0], out[0]), edgeCode(in[0], out[1]), edgeCode(in[1], out[1]), edgeCode(in[1], out[0])};
  } else {
    for (const int i : in) {
      for (const int o : out) codes.push_back(edgeCode(i, o));
    }
  }
  const Vec3 first = placeOf(codes[0]), facing = cross(placeOf(codes[1]) - first, placeOf(codes[2]) - first);
  if (dot(facing, first - middleOf(in)) < 0) std::reverse(codes.begin(), codes.end());
  polygon.count = static_cast<int>(codes.size());
  std::copy(codes.begin(), codes.end(), polygon.at.begin());
  return polygon;
}

using PolygonTable = std::array<Polygon, 81>;  // corner c counts 3^c times its state

const PolygonTable& polygonTable() {
  static const PolygonTable kTable = [] {
    PolygonTable table;
    for (int code = 0; code < 81; ++code) {
      const std::array<State, 4> states{static_cast<State>(code % 3), static_cast<State>(code / 3 % 3),
                                        static_cast<State>(code / 9 % 3), static_cast<State>(code / 27)};
      table[static_cast<std::size_t>(code)] = polygonOf(states);
    }
    return table;
  }();
  return kTable;
}

class Stuffer {
 public:
  Stuffer(const Cloud& cloud, const Lattice& lattice, const Crossings& crossings)
      : cloud_(cloud), lattice_(lattice), crossings_(crossings) {}

  Stuffed run() {
    placeVertices();
    for (std::uint32_t n = 0; n < cloud_.keys.size(); ++n) {
      for (const Tet& tet : kTets) fill(tet, n);
    }
    return {std::move(mesh_), std::move(vertices_), std::move(nodes_), std::move(touching_)};
  }

 private:
  void placeVertices() {
    node_vertex_.assign(cloud_.keys.size(), NodeMap::kNone);
    edge_vertex_.assign(crossings_.from.size(), NodeMap::kNone);
    const auto add = [&](std::uint32_t edge) {
      mesh_.vertices.push_back(crossings_.place(cloud_, lattice_, edge));
      return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
    };
    for (std::uint32_t n = 0; n < cloud_.keys.size(); ++n) {
      states_.push_back(crossings_.moved(n) ? State::OnIt : cloud_.values[n] < 0 ? State::Inside : State::Outside);
      if (crossings_.moved(n)) {
        node_vertex_[n] = add(crossings_.carrier[n]);
        vertices_.push_back(node_vertex_[n]), nodes_.push_back(n);
      }
      for (std::uint32_t e = crossings_.first[n]; e < crossings_.first[n + 1]; ++e) {
        if (crossings_.isCut(e)) edge_vertex_[e] = add(e);
      }
    }
  }

  void fill(const Tet& tet, std::uint32_t first) {
    std::array<std::uint32_t, 4> node{first};
    std::size_t code = static_cast<std::size_t>(states_[first]), weight = 3;
    for (std::size_t c = 1; c < 4; ++c, weight *= 3) {
      node[c] = cloud_.around[first][tet.to_corner[c]];
      if (node[c] == NodeMap::kNone) return;  // a crossed one has all its corners
      code += weight * static_cast<std::size_t>(states_[node[c]]);
    }
    const Polygon& polygon = polygonTable()[code];
    if (polygon.count == 0) {
      for (std::size_t c = 0; c < 4; ++c) fillFace(tet, node, c);
      return;
    }
    std::array<std::uint32_t, 4> v{};
    for (std::size_t i = 0; i < static_cast<std::size_t>(polygon.count); ++i) {
      v[i] = vertexAt(tet, node, polygon.at[i]);
    }
    if (polygon.count == 3) {
      mesh_.triangles.push_back({v[0], v[1], v[2]});
    } else {
      addQuad(v);
    }
  }

  [[nodiscard]] std::uint32_t vertexAt(const Tet& tet, const std::array<std::uint32_t, 4>& node, int code) const {
    if (code < 4) return node_vertex_[node[static_cast<std::size_t>(code)]];
    const auto e = static_cast<std::size_t>(code - 4);
    return edge_vertex_[crossings_.edgeOf(node[static_cast<std::size_t>(tet.owner[e])], tet.step[e])];
  }

  /// The face against corner c, when its three nodes have moved onto the surface and only one of its two tetrahedra is
  /// inside. The inside one adds it. A node across that was never asked has the sign its neighbours had before they
  /// moved, since nothing crosses between them; then the outside one may have to do it.
  void fillFace(const Tet& tet, const std::array<std::uint32_t, 4>& node, std::size_t c) {
    const auto& [i, j, k] = kFaceAgainst[c];
    if (!crossings_.moved(node[i]) || !crossings_.moved(node[j]) || !crossings_.moved(node[k])) return;
    const bool inside = states_[node[c]] == State::Inside;
    const std::uint32_t across = cloud_.around[node[c < 2 ? 2 : 0]][tet.to_mirrored[c]];
    const bool asked = across != NodeMap::kNone;
    const bool inside_across = asked ? states_[across] == State::Inside : cloud_.values[node[i]] < 0;
    if (inside && inside_across) touching_.insert(touching_.end(), {node[i], node[j], node[k]});
    if (inside == inside_across || (asked && !inside)) return;
    const std::uint32_t u = node_vertex_[node[i]], v = node_vertex_[node[j]], w = node_vertex_[node[k]];
    mesh_.triangles.push_back(inside ? std::array{u, v, w} : std::array{u, w, v});
  }

  /// By the diagonal that leaves the larger least angle.
  void addQuad(const std::array<std::uint32_t, 4>& v) {
    const auto& p = mesh_.vertices;
    const double first = std::max(largestCosine(p[v[0]], p[v[1]], p[v[2]]), largestCosine(p[v[0]], p[v[2]], p[v[3]]));
    const double other = std::max(largestCosine(p[v[1]], p[v[2]], p[v[3]]), largestCosine(p[v[1]], p[v[3]], p[v[0]]));
    if (first <= other) {
      mesh_.triangles.push_back({v[0], v[1], v[2]});
      mesh_.triangles.push_back({v[0], v[2], v[3]});
    } else {
      mesh_.triangles.push_back({v[1], v[2], v[3]});
      mesh_.triangles.push_back({v[1], v[3], v[0]});
    }
  }

  const Cloud& cloud_;
  const Lattice& lattice_;
  const Crossings& crossings_;
  std::vector<State> states_;  ///< #nodes
  std::vector<std::uint32_t> node_vertex_, edge_vertex_;
  TriangleMesh mesh_;
  std::vector<std::uint32_t> vertices_, nodes_, touching_;
};

}  // namespace

double largestCosine(const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto cosine = [](const Vec3& at, const Vec3& to, const Vec3& also) {
    const Vec3 u = to - at, v = also - at;
    const double lengths = norm(u) * norm(v);
    return lengths > 0 ? dot(u, v) / lengths : 1;
  };
  return std::max({cosine(a, b, c), cosine(b, c, a), cosine(c, a, b)});
}

Stuffed stuff(const Cloud& cloud, const Lattice& lattice, const Crossings& crossings) {
  return Stuffer(cloud, lattice, crossings).run();
}

}  // namespace spinaltap::mesh
