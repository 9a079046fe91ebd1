// core/mesh/crossings.h - where the surface crosses the lattice's edges, and which nodes move onto it (internal).
// After: Labelle and Shewchuk, "Isosurface Stuffing", SIGGRAPH 2007, sections 3 and 4.
#pragma once
#include <vector>

#include "core/mesh/follow.h"

namespace spinaltap::mesh {

/// A node whose nearest crossing lies within this part of the edge moves there, and its other crossings are dropped.
/// All crossings that are left are farther than this from both ends, so triangles cannot be thin. Below a quarter of
/// the long edges no tetrahedron can turn inside out, so the mesh cannot cut itself; the other number then gives the
/// largest least angle, 13.49 degrees. Both are searched again by the tests.
inline constexpr double kSnapLong = 0.249, kSnapShort = 0.354;

/// Edge e of node n along forward step d is number first[n] + (how many of mask[n]'s bits are below d).
struct Crossings {
  std::vector<std::uint32_t> first;  ///< #nodes + 1
  std::vector<std::uint8_t> mask;    ///< #nodes: bit d: the edge along forward step d is crossed
  std::vector<std::uint32_t> from, to;
  std::vector<double> share;           ///< where, from 0 at `from` to 1 at `to`
  std::vector<std::uint32_t> carrier;  ///< #nodes: the edge on which the node has moved, or NodeMap::kNone

  [[nodiscard]] std::uint32_t edgeOf(std::uint32_t node, int step) const {
    unsigned below = mask[node] & ((1U << static_cast<unsigned>(step)) - 1U), count = 0;
    for (; below != 0; below &= below - 1) ++count;
    return first[node] + count;
  }
  [[nodiscard]] bool moved(std::uint32_t node) const { return carrier[node] != NodeMap::kNone; }
  /// Both ends stay where they are, so the crossing is a vertex of its own.
  [[nodiscard]] bool isCut(std::uint32_t edge) const { return !moved(from[edge]) && !moved(to[edge]); }
  [[nodiscard]] Vec3 place(const Cloud& cloud, const Lattice& lattice, std::uint32_t edge) const {
    const Vec3 a = lattice.place(nodeOf(cloud.keys[from[edge]])), b = lattice.place(nodeOf(cloud.keys[to[edge]]));
    return a + (b - a) * share[edge];
  }
};

/// A node moves only if the bone and what is outside keep their shape without it (each stays as connected around it as
/// it was), so that neither thin sheets nor narrow gaps are lost. Else its crossings stay vertices, held at their
/// distance.
///
/// Finds the crossings that become vertices to kRootTolerance, a batch a round; the others stay estimates.
class CrossingFinder {
 public:
  /// All are kept by reference.
  CrossingFinder(const Field& field, const Lattice& lattice, const Cloud& cloud);

  /// Until every crossing that is a vertex is found, or kMostRounds are used up. @error NotFinite.
  [[nodiscard]] Result<void> refine(const std::function<void(double)>& progress);
  /// Puts these nodes back to their place for good. Other nodes may then move instead, by what is known so far.
  void hold(std::span<const std::uint32_t> nodes);
  /// Crossings that are nearer to a held node than they may be are held at that distance.
  [[nodiscard]] Crossings crossings() const;
  /// Whether refine() would ask the field.
  [[nodiscard]] bool isSettled() const { return rounds_ == kMostRounds || openEdges().empty(); }

 private:
  void listEdges();
  void addEdge(std::uint32_t from, std::uint32_t to, bool is_long);
  void moveNodes();
  [[nodiscard]] std::vector<std::uint32_t> openEdges() const;
  [[nodiscard]] Result<void> ask(const std::vector<std::uint32_t>& open);
  void narrow(std::uint32_t edge, double value);

  /// The crossing lies in [low, high] of its edge, the values there of opposite sign.
  struct Bracket {
    double low = 0, high = 1, at_low, at_high;
    int kept = 0;  ///< which end stayed put last time: +1 high, -1 low
  };
  static double aim(const Bracket& bracket);
  [[nodiscard]] std::uint8_t levelOf(std::uint32_t edge) const;

  static constexpr int kMostRounds = 32;

  const Field& field_;
  const Lattice& lattice_;
  const Cloud& cloud_;
  Crossings made_;
  // #edges, apart from each other because most rounds look at one byte of each:
  std::vector<Bracket> brackets_;
  std::vector<double> snap_;
  std::vector<std::uint8_t> level_;  ///< how near the crossing is to an end: see levelOf
  std::vector<bool> found_;
  // #nodes:
  std::vector<Neighbours> alike_;  ///< those on the same side
  std::vector<bool> held_;
  int rounds_ = 0;
};

}  // namespace spinaltap::mesh
