#include "core/rbf/fast_sum.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/base/parallel.h"
#include "core/rbf/simd_dense.h"

namespace spinaltap::rbf {
namespace {

// Target nodes that one thread takes at a time.
constexpr std::size_t kGroup = 192;
constexpr std::size_t kColumns = 64;  // far pairs multiplied at a time

/// Distances between cubes, sorted downwards, are (2, 0, 0) .. (3, 3, 3).
int kindOf(int a, int b, int c) { return (a == 2 ? 0 : 6) + b * (b + 1) / 2 + c; }

constexpr std::array<std::array<int, 3>, 6> kOrders{{{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};

struct Turn {
  std::uint8_t kind, turn;
};

/// The symmetry of the cube that turns an offset into its sorted, positive form.
Turn turnOf(const std::array<int, 3>& offset) {
  const std::array<int, 3> size{std::abs(offset[0]), std::abs(offset[1]), std::abs(offset[2])};
  for (std::size_t order = 0; order < 6; ++order) {
    const auto axis = [&](std::size_t n) { return static_cast<std::size_t>(kOrders[order][n]); };
    if (size[axis(0)] < size[axis(1)] || size[axis(1)] < size[axis(2)]) continue;
    int signs = 0;
    for (std::size_t n = 0; n < 3; ++n) signs |= offset[axis(n)] < 0 ? 1 << n : 0;
    return {static_cast<std::uint8_t>(kindOf(size[axis(0)], size[axis(1)], size[axis(2)])),
            static_cast<std::uint8_t>(order * 8 + static_cast<std::size_t>(signs))};
  }
  return {0, 0};
}

std::vector<std::uint16_t> turnedNodes(int p, std::size_t turn) {
  std::vector<std::uint16_t> out;
  for (int a = 0; a < p; ++a) {
    for (int b = 0; b < p; ++b) {
      for (int c = 0; c < p; ++c) {
        const std::array<int, 3> at{a, b, c};
        int index = 0;
        for (std::size_t n = 0; n < 3; ++n) {
          const int along = at[static_cast<std::size_t>(kOrders[turn / 8][n])];
          index = index * p + ((turn % 8 >> n & 1) != 0 ? p - 1 - along : along);
        }
        out.push_back(static_cast<std::uint16_t>(index));
      }
    }
  }
  return out;
}

/// Distances from the nodes of a source cube `offset` cubes away to those of the target cube, both of half side 1.
std::vector<double> farMatrix(const Chebyshev& c, int a, int b, int e) {
  const int p = c.nodes();
  std::vector<double> m(c.stored() * c.values(), 0.0);
  const auto square = [&](int offset, int source, int target) {
    const double d = 2.0 * offset + c.root(source) - c.root(target);
    return d * d;
  };
  std::size_t column = 0;
  for (int s0 = 0; s0 < p; ++s0)
    for (int s1 = 0; s1 < p; ++s1)
      for (int s2 = 0; s2 < p; ++s2, ++column) {
        double* to = m.data() + column * c.stored();
        for (int t0 = 0; t0 < p; ++t0)
          for (int t1 = 0; t1 < p; ++t1)
            for (int t2 = 0; t2 < p; ++t2) *to++ = std::sqrt(square(a, s0, t0) + square(b, s1, t1) + square(e, s2, t2));
      }
  return m;
}

std::vector<std::vector<double>> farMatrices(const Chebyshev& c) {
  std::vector<std::vector<double>> out;
  for (int a = 2; a <= 3; ++a)
    for (int b = 0; b <= a; ++b)
      for (int e = 0; e <= b; ++e) out.push_back(farMatrix(c, a, b, e));
  return out;
}

/// Points gathered from several places, relative to a middle.
template <class T>
struct Gathered {
  std::vector<T> x, y, z, w;

  void clear() { x.clear(), y.clear(), z.clear(), w.clear(); }
  void add(const PointArrays<double>& p, const double* weights, const Vec3& middle) {
    for (std::size_t n = 0; n < p.count; ++n) {
      x.push_back(static_cast<T>(p.x[n] - middle.x)), y.push_back(static_cast<T>(p.y[n] - middle.y));
      z.push_back(static_cast<T>(p.z[n] - middle.z));
      if (weights != nullptr) w.push_back(static_cast<T>(weights[n]));
    }
  }
  [[nodiscard]] PointArrays<T> points() const { return {x.data(), y.data(), z.data(), x.size()}; }
};

/// The nodes of a cube as points, relative to the root's middle.
Gathered<double> nodesOf(const Chebyshev& c, const Octree& tree, const OctreeNode& node) {
  Gathered<double> out;
  const Vec3 middle = tree.middleOf(node);
  const double half = tree.halfOf(node.level);
  for (int i = 0; i < c.nodes(); ++i)
    for (int j = 0; j < c.nodes(); ++j)
      for (int k = 0; k < c.nodes(); ++k) {
        out.x.push_back(middle.x + half * c.root(i));
        out.y.push_back(middle.y + half * c.root(j));
        out.z.push_back(middle.z + half * c.root(k));
      }
  return out;
}

int octantOf(const OctreeNode& child) { return (child.at[0] & 1) | (child.at[1] & 1) << 1 | (child.at[2] & 1) << 2; }

std::vector<double> sorted(const Octree& tree, std::span<const double> values) {
  std::vector<double> out(values.size());
  for (std::size_t n = 0; n < out.size(); ++n) out[n] = values[tree.order()[n]];
  return out;
}

}  // namespace

/// Walks both trees from their roots and decides, pair by pair, how one cube's points reach another's.
class FastSum::Listing {
 public:
  explicit Listing(FastSum& sum)
      : sum_(sum),
        targets_(sum.targets_->nodes()),
        sources_(sum.sources_->nodes()),
        few_(sum.orders_.back()->chebyshev.values()) {
    // A pair of far cubes costs a product of p^3 by p^3; this many pairs of points cost about as much.
    direct_ = few_ * few_ / (sum.options_.single_near ? 8 : 20);
    equal(0, 0);
    sum.near_ = listsOf(near_);
    sum.from_nodes_ = listsOf(from_nodes_);
    sum.to_nodes_ = listsOf(to_nodes_);
    groupFar();
  }

 private:
  using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

  /// Two cubes of one level.
  void equal(std::uint32_t t, std::uint32_t s) {
    const OctreeNode &target = targets_[t], &source = sources_[s];
    std::array<int, 3> offset{};
    bool apart = false;
    for (std::size_t n = 0; n < 3; ++n) {
      offset[n] = source.at[n] - target.at[n];
      apart = apart || std::abs(offset[n]) > 1;
    }
    if (apart) {
      const std::size_t pairs = std::size_t{target.count} * source.count;
      if (target.leaf() && source.leaf() && pairs < direct_) {
        near_.emplace_back(t, s);
      } else {
        const Turn turn = turnOf(offset);
        sum_.far_.push_back({t, s, turn.kind, turn.turn});
      }
    } else if (target.leaf() && source.leaf()) {
      near_.emplace_back(t, s);
    } else if (target.leaf()) {
      eachChild(source, [&](std::uint32_t c) { smallerSource(t, c); });
    } else if (source.leaf()) {
      eachChild(target, [&](std::uint32_t c) { smallerTarget(c, s); });
    } else {
      eachChild(target, [&](std::uint32_t ct) { eachChild(source, [&](std::uint32_t cs) { equal(ct, cs); }); });
    }
  }

  void smallerSource(std::uint32_t t, std::uint32_t s) {
    const OctreeNode& source = sources_[s];
    if (touch(targets_[t], source)) {
      if (source.leaf()) {
        near_.emplace_back(t, s);
      } else {
        eachChild(source, [&](std::uint32_t c) { smallerSource(t, c); });
      }
    } else if (source.count <= few_) {
      allLeaves(source, s, [&](std::uint32_t leaf) { near_.emplace_back(t, leaf); }, sources_);
    } else {
      from_nodes_.emplace_back(t, s);
    }
  }

  void smallerTarget(std::uint32_t t, std::uint32_t s) {
    const OctreeNode& target = targets_[t];
    if (touch(sources_[s], target)) {
      if (target.leaf()) {
        near_.emplace_back(t, s);
      } else {
        eachChild(target, [&](std::uint32_t c) { smallerTarget(c, s); });
      }
    } else if (target.count <= few_) {
      allLeaves(target, t, [&](std::uint32_t leaf) { near_.emplace_back(leaf, s); }, targets_);
    } else {
      to_nodes_.emplace_back(t, s);
    }
  }

  template <class Use>
  static void eachChild(const OctreeNode& node, const Use& use) {
    for (std::int32_t n = 0; n < node.child_count; ++n) use(static_cast<std::uint32_t>(node.children + n));
  }

  template <class Use>
  void allLeaves(const OctreeNode& node, std::uint32_t index, const Use& use, const std::vector<OctreeNode>& nodes) {
    if (node.leaf()) return use(index);
    eachChild(node, [&](std::uint32_t c) { allLeaves(nodes[c], c, use, nodes); });
  }

  /// Whether a smaller cube touches a larger one.
  static bool touch(const OctreeNode& large, const OctreeNode& small) {
    const int levels = small.level - large.level;
    for (std::size_t n = 0; n < 3; ++n) {
      const std::int64_t low = std::int64_t{large.at[n]} << levels, high = (std::int64_t{large.at[n]} + 1) << levels;
      if (small.at[n] + 1 < low || small.at[n] > high) return false;
    }
    return true;
  }

  [[nodiscard]] Lists listsOf(Pairs& pairs) const {
    std::stable_sort(pairs.begin(), pairs.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    Lists out;
    out.first.assign(targets_.size() + 1, 0);
    for (const auto& [t, s] : pairs) {
      ++out.first[t + 1];
      out.source.push_back(s);
    }
    for (std::size_t n = 1; n < out.first.size(); ++n) out.first[n] += out.first[n - 1];
    return out;
  }

  void groupFar() {
    const auto group = [](const FarPair& f) { return f.target / kGroup; };
    std::stable_sort(sum_.far_.begin(), sum_.far_.end(), [&](const FarPair& a, const FarPair& b) {
      if (group(a) != group(b)) return group(a) < group(b);
      const int level_a = targets_[a.target].level, level_b = targets_[b.target].level;
      return level_a != level_b ? level_a < level_b : a.kind < b.kind;
    });
    sum_.far_first_.assign(targets_.size() / kGroup + 2, 0);
    for (const FarPair& f : sum_.far_) ++sum_.far_first_[group(f) + 1];
    for (std::size_t n = 1; n < sum_.far_first_.size(); ++n) sum_.far_first_[n] += sum_.far_first_[n - 1];
  }

  FastSum& sum_;
  const std::vector<OctreeNode>&targets_, &sources_;
  std::size_t few_, direct_;
  Pairs near_, from_nodes_, to_nodes_;
};

FastSum::Order::Order(int nodes) : chebyshev(nodes), matrices(farMatrices(chebyshev)) {
  for (std::size_t turn = 0; turn < turns.size(); ++turn) turns[turn] = turnedNodes(nodes, turn);
}

FastSum::FastSum(std::span<const Vec3> sources, std::span<const Vec3> targets, const FastSumOptions& options)
    : options_(options) {
  const RootCube root = RootCube::around(sources, targets);
  sources_ = std::make_shared<const Octree>(sources, root, options.leaf_size);
  const bool same = sources.data() == targets.data() && sources.size() == targets.size();
  // Where no source is near, a target's cube need not be small; deeper than the sources' leaves brings nothing.
  targets_ =
      same ? sources_ : std::make_shared<const Octree>(targets, root, options.target_leaf_size, sources_->depth());
  makeOrders();
  up_first_ = offsetsOf(*sources_), down_first_ = offsetsOf(*targets_);
  Listing listing(*this);
}

void FastSum::makeOrders() {
  // No cube is far from another above level 2.
  constexpr int kFewestNodes = 4, kFirstFar = 2;
  const int levels = std::max(sources_->depth(), targets_->depth()) + 1;
  for (int level = 0; level < levels; ++level) {
    const int nodes = std::max(std::min(kFewestNodes, options_.nodes), options_.nodes - std::max(0, level - kFirstFar));
    if (orders_.empty() || orders_.back()->chebyshev.nodes() != nodes) {
      orders_.push_back(std::make_shared<const Order>(nodes));
    } else {
      orders_.push_back(orders_.back());
    }
    transfers_.push_back(
        level == 0 ? nullptr
                   : std::make_shared<const Transfer>(orderOf(level - 1).chebyshev, orderOf(level).chebyshev));
  }
}

FastSum::Offsets FastSum::offsetsOf(const Octree& tree) const {
  Offsets out{0};
  for (const OctreeNode& node : tree.nodes()) out.push_back(out.back() + orderOf(node.level).chebyshev.stored());
  return out;
}

std::size_t FastSum::bytes() const {
  return far_.size() * sizeof(FarPair) + (near_.source.size() + from_nodes_.source.size()) * sizeof(std::uint32_t) +
         (sources_->size() + targets_->size()) * 28 + (up_first_.back() + down_first_.back()) * sizeof(double);
}

FastSum::Values FastSum::gatherUp(std::span<const double> weights) const {
  const Octree& tree = *sources_;
  const std::vector<OctreeNode>& nodes = tree.nodes();
  Values up(up_first_.back(), 0.0);
  parallelBlocks(nodes.size(), 16, options_.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      if (!nodes[n].leaf()) continue;
      const Vec3 m = tree.middleOf(nodes[n]);
      const double middle[3] = {m.x, m.y, m.z};
      orderOf(nodes[n].level)
          .chebyshev.gather(tree.points(nodes[n]), weights.data() + nodes[n].first, middle, tree.halfOf(nodes[n].level),
                            up.data() + up_first_[n]);
    }
  });
  for (std::size_t n = nodes.size(); n-- > 0;) {
    for (std::int32_t c = 0; c < nodes[n].child_count; ++c) {
      const std::size_t child = static_cast<std::size_t>(nodes[n].children + c);
      transfers_[static_cast<std::size_t>(nodes[child].level)]->toParent(
          octantOf(nodes[child]), up.data() + up_first_[child], up.data() + up_first_[n]);
    }
  }
  return up;
}

void FastSum::farGroup(std::size_t group, const Values& up, Values& down) const {
  std::vector<double> x, y;
  for (std::size_t from = far_first_[group]; from < far_first_[group + 1];) {
    const int level = targets_->nodes()[far_[from].target].level;
    const Order& order = orderOf(level);
    const std::size_t stored = order.chebyshev.stored(), count = order.chebyshev.values();
    const double scale = sources_->halfOf(level);
    x.resize(count * kColumns), y.resize(stored * kColumns);
    std::size_t columns = 0;
    for (; columns < kColumns && from + columns < far_first_[group + 1]; ++columns) {
      const FarPair& pair = far_[from + columns];
      if (pair.kind != far_[from].kind || targets_->nodes()[pair.target].level != level) break;
      const double* const source = up.data() + up_first_[pair.source];
      const std::vector<std::uint16_t>& turn = order.turns[pair.turn];
      double* const to = x.data() + columns * count;
      for (std::size_t n = 0; n < count; ++n) to[turn[n]] = scale * source[n];
    }
    multiply(order.matrices[far_[from].kind].data(), stored, count, x.data(), count, columns, y.data(), stored);
    for (std::size_t c = 0; c < columns; ++c) {
      const FarPair& pair = far_[from + c];
      double* const target = down.data() + down_first_[pair.target];
      const std::vector<std::uint16_t>& turn = order.turns[pair.turn];
      const double* const result = y.data() + c * stored;
      for (std::size_t n = 0; n < count; ++n) target[n] += result[turn[n]];
    }
    from += columns;
  }
}

FastSum::Values FastSum::passAcross(const Values& up, std::span<const double> weights) const {
  const std::vector<OctreeNode>& nodes = targets_->nodes();
  Values down(down_first_.back(), 0.0);
  parallelBlocks(far_first_.size() - 1, 1, options_.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t group = begin; group < end; ++group) farGroup(group, up, down);
  });
  parallelBlocks(nodes.size(), 16, options_.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      if (to_nodes_.first[n] == to_nodes_.first[n + 1]) continue;
      const Gathered<double> at = nodesOf(orderOf(nodes[n].level).chebyshev, *targets_, nodes[n]);
      for (std::uint32_t i = to_nodes_.first[n]; i < to_nodes_.first[n + 1]; ++i) {
        const OctreeNode& source = sources_->nodes()[to_nodes_.source[i]];
        addDistances(at.points(), sources_->points(source), weights.data() + source.first,
                     down.data() + down_first_[n]);
      }
    }
  });
  return down;
}

void FastSum::passDown(Values& down) const {
  const std::vector<OctreeNode>& nodes = targets_->nodes();
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    for (std::int32_t c = 0; c < nodes[n].child_count; ++c) {
      const std::size_t child = static_cast<std::size_t>(nodes[n].children + c);
      transfers_[static_cast<std::size_t>(nodes[child].level)]->toChild(
          octantOf(nodes[child]), down.data() + down_first_[n], down.data() + down_first_[child]);
    }
  }
}

template <class Use>
void FastSum::eachLeaf(const Values& up, std::span<const double> weights, const Use& use) const {
  const std::vector<OctreeNode>& nodes = targets_->nodes();
  parallelBlocks(nodes.size(), 8, options_.threads, [&](std::size_t begin, std::size_t end) {
    Gathered<double> wide;
    Gathered<float> narrow;
    for (std::size_t n = begin; n < end; ++n) {
      const OctreeNode& node = nodes[n];
      if (!node.leaf() || node.count == 0) continue;
      const Vec3 middle = targets_->middleOf(node);
      wide.clear(), narrow.clear();
      for (std::uint32_t i = near_.first[n]; i < near_.first[n + 1]; ++i) {
        const OctreeNode& source = sources_->nodes()[near_.source[i]];
        if (options_.single_near) {
          narrow.add(sources_->points(source), weights.data() + source.first, middle);
        } else {
          wide.add(sources_->points(source), weights.data() + source.first, middle);
        }
      }
      for (std::uint32_t i = from_nodes_.first[n]; i < from_nodes_.first[n + 1]; ++i) {
        const std::size_t source = from_nodes_.source[i];
        const OctreeNode& cube = sources_->nodes()[source];
        const Gathered<double> at = nodesOf(orderOf(cube.level).chebyshev, *sources_, cube);
        wide.add(at.points(), up.data() + up_first_[source], middle);
      }
      use(n, middle, wide, narrow);
    }
  });
}

void FastSum::values(std::span<const double> weights, std::span<double> out) const {
  const std::vector<double> w = sorted(*sources_, weights);
  const Values up = gatherUp(w);
  Values down = passAcross(up, w);
  passDown(down);
  std::vector<double> sums(targets_->size(), 0.0);
  eachLeaf(up, w, [&](std::size_t n, const Vec3& m, const Gathered<double>& wide, const Gathered<float>& narrow) {
    const OctreeNode& node = targets_->nodes()[n];
    const PointArrays<double> points = targets_->points(node);
    double* const to = sums.data() + node.first;
    const double middle[3] = {m.x, m.y, m.z};
    orderOf(node.level)
        .chebyshev.spread(down.data() + down_first_[n], middle, targets_->halfOf(node.level), points, to);
    Gathered<double> own;
    own.add(points, nullptr, m);
    if (!wide.x.empty()) addDistances(own.points(), wide.points(), wide.w.data(), to);
    if (!narrow.x.empty()) {
      Gathered<float> single;
      single.add(points, nullptr, m);
      addDistances(single.points(), narrow.points(), narrow.w.data(), to);
    }
  });
  for (std::size_t n = 0; n < sums.size(); ++n) out[targets_->order()[n]] = sums[n];
}

void FastSum::gradients(std::span<const double> weights, std::span<Vec3> out) const {
  const std::vector<double> w = sorted(*sources_, weights);
  const Values up = gatherUp(w);
  Values down = passAcross(up, w);
  passDown(down);
  std::vector<double> x(targets_->size(), 0.0), y = x, z = x;
  eachLeaf(up, w, [&](std::size_t n, const Vec3& m, const Gathered<double>& wide, const Gathered<float>& narrow) {
    const OctreeNode& node = targets_->nodes()[n];
    const PointArrays<double> points = targets_->points(node);
    const std::size_t at = node.first;
    const double middle[3] = {m.x, m.y, m.z};
    orderOf(node.level)
        .chebyshev.spreadGradient(down.data() + down_first_[n], middle, targets_->halfOf(node.level), points,
                                  x.data() + at, y.data() + at, z.data() + at);
    Gathered<double> own;
    own.add(points, nullptr, m);
    if (!wide.x.empty())
      addDirections(own.points(), wide.points(), wide.w.data(), x.data() + at, y.data() + at, z.data() + at);
    if (!narrow.x.empty()) {
      Gathered<float> single;
      single.add(points, nullptr, m);
      addDirections(single.points(), narrow.points(), narrow.w.data(), x.data() + at, y.data() + at, z.data() + at);
    }
  });
  for (std::size_t n = 0; n < x.size(); ++n) out[targets_->order()[n]] = {x[n], y[n], z[n]};
}

}  // namespace spinaltap::rbf
