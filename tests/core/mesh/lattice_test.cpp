// What the polygoniser's promises rest on, searched through all ways a tetrahedron can be cut.
#include "core/mesh/lattice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <set>
#include <utility>
#include <vector>

#include "core/base/random.h"
#include "core/mesh/crossings.h"
#include "core/mesh/polygonise.h"
#include "tests/core/mesh/mesh_check.h"

namespace spinaltap::mesh {
namespace {

using Tetrahedron = std::array<Vec3, 4>;

Vec3 toVec(const Node& n) { return {1.0 * n.x, 1.0 * n.y, 1.0 * n.z}; }

Tetrahedron cornersOf(const Tet& tet) {
  return {toVec(tet.corner[0]), toVec(tet.corner[1]), toVec(tet.corner[2]), toVec(tet.corner[3])};
}

double sixVolumes(const Tetrahedron& t) { return dot(t[1] - t[0], cross(t[2] - t[0], t[3] - t[0])); }

double snapOf(const Node& step) { return isLong(stepBetween({0, 0, 0}, step)) ? kSnapLong : kSnapShort; }

TEST(Lattice, KeysComeBackAsTheirNodesAndKeepTheOrderOfBricks) {
  Random random(7);
  for (int n = 0; n < 10000; ++n) {
    const int odd = static_cast<int>(random.below(2));
    const auto any = [&] { return static_cast<int>(random.below(1U << 20)) * 2 + odd; };
    const Node node{any(), any(), any()};
    ASSERT_EQ(nodeOf(keyOf(node)), node);
  }
  EXPECT_LT(keyOf({14, 14, 14}), keyOf({16, 0, 0}));
}

TEST(Lattice, TetrahedraFillSpaceOnceAndAreRightHanded) {
  // Six a node, two nodes in a cube of side 2 (volume 8): they fill it when each has a sixth of 4.
  for (const Tet& tet : kTets) EXPECT_EQ(sixVolumes(cornersOf(tet)), 4);
  // And none is met from two nodes: the sets of corners around a node, moved to one place, are all different.
  std::set<std::vector<Key>> seen;
  for (int n = 0; n < 2 * 8 * 8 * 8; ++n) {
    const int odd = n % 2;
    const Node base{8 + odd + n / 2 % 8 * 2, 8 + odd + n / 16 % 8 * 2, 8 + odd + n / 128 * 2};
    for (const Tet& tet : kTets) {
      std::vector<Key> keys;
      for (const Node& c : tet.corner) keys.push_back(keyOf(base + c));
      std::sort(keys.begin(), keys.end());
      EXPECT_TRUE(seen.insert(keys).second);
    }
  }
}

TEST(Lattice, RingsHoldTheCommonNeighboursOfAnEdge) {
  for (std::size_t d = 0; d < kForward; ++d) EXPECT_EQ(kEdgeRing[d].count, isLong(static_cast<int>(d)) ? 4 : 6);
}

/// Where a moved node may stand: by up to the snap along any of its 14 edges.
struct Move {
  Vec3 from, most, end;  ///< `end`: the node at the other end of that edge
};

std::vector<Move> movesOf(const Vec3& corner) {
  std::vector<Move> moves;
  for (const Node& step : kStep) moves.push_back({corner, toVec(step) * snapOf(step), corner + toVec(step)});
  return moves;
}

/// Two nodes cannot both move along the edge between them: its one crossing is used up by the first.
template <class T>
bool shareAnEdge(const T& a, const T& b) {
  return a.end == b.from && b.end == a.from;
}

/// The volume is linear in each node's way, so its least value lies where every node stays or moves as far as it may.
TEST(Lattice, NoTetrahedronTurnsInsideOutHoweverItsNodesMove) {
  const Tetrahedron corners = cornersOf(kTets[0]);
  std::array<std::vector<Move>, 4> moves;
  for (std::size_t c = 0; c < 4; ++c) {
    moves[c] = movesOf(corners[c]);
    moves[c].push_back({corners[c], {}, corners[c]});
  }
  double least = 4;
  for (const Move& a : moves[0])
    for (const Move& b : moves[1])
      for (const Move& c : moves[2])
        for (const Move& d : moves[3]) {
          if (shareAnEdge(a, b) || shareAnEdge(a, c) || shareAnEdge(a, d)) continue;
          if (shareAnEdge(b, c) || shareAnEdge(b, d) || shareAnEdge(c, d)) continue;
          least = std::min(least, sixVolumes({a.from + a.most, b.from + b.most, c.from + c.most, d.from + d.most}));
        }
  EXPECT_GT(least, 0);
  std::printf("  least volume: %.4f of 1\n", least / 4);
}

/// A vertex of a triangle and how far it can go: from + t * way, t in [low, high].
struct Range {
  Vec3 from, way;
  double low, high;
  Vec3 end;  ///< as a move's; not a corner for a cut
};

double leastAngle(const Vec3& a, const Vec3& b, const Vec3& c) {
  return std::min(
      {detail::angleBetween(b - a, c - a), detail::angleBetween(c - b, a - b), detail::angleBetween(a - c, b - c)});
}

/// Pattern search from random starts; ends of ranges are tried most, since there the minima lie.
double leastOver(const std::vector<Range>& ranges, const std::function<double(const std::vector<Vec3>&)>& angle,
                 int starts, Random& random) {
  double least = 180;
  const auto at = [&](const std::vector<double>& t) {
    std::vector<Vec3> places;
    for (std::size_t i = 0; i < ranges.size(); ++i) places.push_back(ranges[i].from + ranges[i].way * t[i]);
    return angle(places);
  };
  for (int start = 0; start < starts; ++start) {
    std::vector<double> t;
    for (const Range& r : ranges) {
      const std::uint64_t kind = random.below(3);
      t.push_back(kind == 0 ? r.low : kind == 1 ? r.high : random.uniform(r.low, r.high));
    }
    double best = at(t);
    for (double step = 0.5; step > 1e-3;) {
      bool better = false;
      for (std::size_t i = 0; i < 2 * t.size(); ++i) {
        const Range& r = ranges[i / 2];
        std::vector<double> to = t;
        to[i / 2] = std::clamp(t[i / 2] + (i % 2 == 0 ? step : -step) * (r.high - r.low), r.low, r.high);
        if (const double value = at(to); value < best) best = value, t = to, better = true;
      }
      if (!better) step /= 2;
    }
    least = std::min(least, best);
  }
  return least;
}

class AngleSearch {
 public:
  double threeCuts() {
    double least = 180;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto o = others(i, i);
      least = std::min(least, triangles({cut(i, o[0])}, {cut(i, o[1])}, {cut(i, o[2])}, 30));
    }
    return least;
  }
  /// The better of two diagonals is taken.
  double fourCuts() {
    double least = 180;
    for (std::size_t j = 1; j < 4; ++j) {
      const auto o = others(0, j);
      const std::vector<Range> around{cut(0, o[0]), cut(0, o[1]), cut(j, o[1]), cut(j, o[0])};
      least =
          std::min(least, leastOver(
                              around,
                              [](const std::vector<Vec3>& p) {
                                return std::max(std::min(leastAngle(p[0], p[1], p[2]), leastAngle(p[0], p[2], p[3])),
                                                std::min(leastAngle(p[1], p[2], p[3]), leastAngle(p[1], p[3], p[0])));
                              },
                              30, random_));
    }
    return least;
  }
  double oneMovedTwoCuts() {
    double least = 180;
    for (std::size_t moved = 0; moved < 4; ++moved)
      for (const std::size_t lone : others(moved, moved)) {
        const auto o = others(moved, lone);
        least = std::min(least, triangles(moves(moved), {cut(lone, o[0])}, {cut(lone, o[1])}, 10));
      }
    return least;
  }
  double twoMovedOneCut() {
    double least = 180;
    for (std::size_t a = 0; a < 4; ++a)
      for (std::size_t b = a + 1; b < 4; ++b) {
        const auto o = others(a, b);
        least = std::min(least, triangles(moves(a), moves(b), {cut(o[0], o[1])}, 2));
      }
    return least;
  }
  double threeMoved() {
    double least = 180;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto o = others(i, i);
      least = std::min(least, triangles(moves(o[0]), moves(o[1]), moves(o[2]), 1));
    }
    return least;
  }

 private:
  static std::vector<std::size_t> others(std::size_t a, std::size_t b) {
    std::vector<std::size_t> out;
    for (std::size_t c = 0; c < 4; ++c) {
      if (c != a && c != b) out.push_back(c);
    }
    return out;
  }
  [[nodiscard]] Range cut(std::size_t a, std::size_t b) const {
    const double snap = snapOf(kTets[0].corner[b] - kTets[0].corner[a]);
    return {corners_[a], corners_[b] - corners_[a], snap, 1 - snap, {9, 9, 9}};
  }
  [[nodiscard]] std::vector<Range> moves(std::size_t c) const {
    std::vector<Range> out;
    for (const Move& m : movesOf(corners_[c])) out.push_back({m.from, m.most, 0, 1, m.end});
    return out;
  }
  double triangles(const std::vector<Range>& as, const std::vector<Range>& bs, const std::vector<Range>& cs,
                   int starts) {
    double least = 180;
    for (const Range& a : as)
      for (const Range& b : bs)
        for (const Range& c : cs) {
          if (shareAnEdge(a, b) || shareAnEdge(b, c) || shareAnEdge(a, c)) continue;
          const auto angle = [](const std::vector<Vec3>& p) { return leastAngle(p[0], p[1], p[2]); };
          least = std::min(least, leastOver({a, b, c}, angle, starts, random_));
        }
    return least;
  }

  const Tetrahedron corners_ = cornersOf(kTets[0]);
  Random random_{2007};
};

TEST(Lattice, NoCutOfATetrahedronGivesAnAngleBelowTheStatedOne) {
  AngleSearch search;
  const double angles[] = {search.threeCuts(), search.fourCuts(), search.oneMovedTwoCuts(), search.twoMovedOneCut(),
                           search.threeMoved()};
  std::printf("  cuts 3: %.2f, 4: %.2f; moved nodes and cuts 1+2: %.2f, 2+1: %.2f, 3: %.2f degrees\n", angles[0],
              angles[1], angles[2], angles[3], angles[4]);
  const double least = *std::min_element(std::begin(angles), std::end(angles));
  EXPECT_GE(least, kLeastAngle_deg);
  EXPECT_LT(least, kLeastAngle_deg + 0.2) << "the promise could be better";
}

}  // namespace
}  // namespace spinaltap::mesh
