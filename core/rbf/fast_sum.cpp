#include "core/rbf/fast_sum.h"

#include <algorithm>
#include <cmath>

#include "core/base/parallel.h"

namespace spinaltap::rbf {
namespace {

constexpr std::size_t kColumns = 64;      // far pairs multiplied at a time
constexpr std::size_t kPairOfNodes = 10;  // a near pair of points costs so many products of a far pair

/// Points gathered from several places, relative to a middle.
template <class T>
struct Gathered {
  std::vector<T> x, y, z, w;

  void clear() { x.clear(), y.clear(), z.clear(), w.clear(); }
  void add(const PointArrays<double>& p, const double* weights, const Vec3& middle) {
    const std::size_t first = x.size();
    for (std::vector<T>* const axis : {&x, &y, &z}) axis->resize(first + p.count);
    for (std::size_t n = 0; n < p.count; ++n) x[first + n] = static_cast<T>(p.x[n] - middle.x);
    for (std::size_t n = 0; n < p.count; ++n) y[first + n] = static_cast<T>(p.y[n] - middle.y);
    for (std::size_t n = 0; n < p.count; ++n) z[first + n] = static_cast<T>(p.z[n] - middle.z);
    if (weights == nullptr) return;
    w.resize(first + p.count);
    for (std::size_t n = 0; n < p.count; ++n) w[first + n] = static_cast<T>(weights[n]);
  }
  void addAll(const Gathered<double>& from) {
    for (std::size_t n = 0; n < from.x.size(); ++n) {
      x.push_back(static_cast<T>(from.x[n])), y.push_back(static_cast<T>(from.y[n]));
      z.push_back(static_cast<T>(from.z[n])), w.push_back(static_cast<T>(from.w[n]));
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

/// Of single precision: the standard deviation of the sum of these points, seen from up to `half` along each axis, if
/// the pairs' roundings are independent.
double singleError(const Gathered<double>& near, double half) {
  constexpr double kRounding = 6e-8;
  double squares = 0;
  for (std::size_t n = 0; n < near.x.size(); ++n) {
    const double reach = half * 1.75 + std::sqrt(near.x[n] * near.x[n] + near.y[n] * near.y[n] + near.z[n] * near.z[n]);
    squares += near.w[n] * near.w[n] * reach * reach;
  }
  return kRounding * std::sqrt(squares);
}

/// Where no source is near, a target's cube need not be small; deeper than the sources' leaves brings nothing.
std::shared_ptr<const Octree> treeOf(const FastSources& sources, std::span<const Vec3> targets,
                                     const FastSumOptions& options) {
  const Octree& tree = sources.tree();
  return std::make_shared<const Octree>(targets, tree.root(), options.target_leaf_size, tree.depth());
}

}  // namespace

FastSum::FastSum(std::span<const Vec3> sources, std::span<const Vec3> targets, const FastSumOptions& options) {
  const auto made = std::make_shared<const FastSources>(sources, RootCube::around(sources, targets), options);
  const bool same = sources.data() == targets.data() && sources.size() == targets.size();
  meet(made, same ? std::shared_ptr<const Octree>(made, &made->tree()) : treeOf(*made, targets, options));
}

FastSum::FastSum(const std::shared_ptr<const FastSources>& sources, std::span<const Vec3> targets,
                 const FastSumOptions& options) {
  meet(sources, treeOf(*sources, targets, options));
}

void FastSum::meet(std::shared_ptr<const FastSources> sources, std::shared_ptr<const Octree> targets) {
  sources_ = std::move(sources), targets_ = std::move(targets);
  const FarOrder& last = *sources_->levels().back().orders[0];
  seen_ = interactionsOf(*targets_, sources_->tree(), last.chebyshev().values(), last.products() / kPairOfNodes);
  down_first_ = sources_->offsetsOf(*targets_);
}

template <class T>
void FastSum::farColumns(std::size_t from, std::size_t columns, const Values& up, Values& down, std::vector<T>& x,
                         std::vector<T>& y) const {
  const OctreeNode& first = targets_->nodes()[seen_.far[from].target];
  const FastSources::Level& level = sources_->levelOf(first);
  const int kind = seen_.far[from].kind.kind;
  const FarOrder& order = level.orderOf(kind);
  const std::size_t stored = order.stored(), count = order.terms();
  const double scale = sources_->tree().halfOf(first.level), distance = FarOrder::distance(kind);
  const std::array<double, 3> direction = FarOrder::direction(kind);
  x.resize(count * kColumns), y.resize(stored * kColumns);
  std::array<std::array<double, 4>, kColumns> seen;  // what is not in the matrices
  for (std::size_t c = 0; c < columns; ++c) {
    const Interactions::FarPair& pair = seen_.far[from + c];
    const double* const source = up.data() + sources_->first()[pair.source] + level.terms;
    const FarOrder::Turn& turn = order.turned(pair.kind.turn);
    T* const to = x.data() + c * count;
    for (std::size_t n = 0; n < count; ++n) to[turn.term[n]] = static_cast<T>(scale * turn.sign[n] * source[n]);
    const double sum = scale * source[0];
    seen[c][0] = distance * sum;
    for (std::size_t n = 1; n < 4; ++n) {
      const double along = turn.sign[n] * direction[turn.term[n] - 1U];
      seen[c][0] += scale * source[n] * along, seen[c][n] = -sum * along;
    }
  }
  order.see(kind, x.data(), columns, y.data());
  for (std::size_t c = 0; c < columns; ++c) {
    const Interactions::FarPair& pair = seen_.far[from + c];
    double* const target = down.data() + down_first_[pair.target] + level.terms;
    const FarOrder::Turn& turn = order.turned(pair.kind.turn);
    const T* const result = y.data() + c * stored;
    for (std::size_t n = 0; n < count; ++n) target[n] += turn.sign[n] * static_cast<double>(result[turn.term[n]]);
    for (std::size_t n = 0; n < 4; ++n) target[n] += seen[c][n];
  }
}

void FastSum::farGroup(std::size_t group, const Values& up, Values& down) const {
  std::vector<double> x, y;
  std::vector<float> single_x, single_y;
  const std::vector<OctreeNode>& nodes = targets_->nodes();
  const std::size_t end = seen_.far_first[group + 1];
  for (std::size_t from = seen_.far_first[group]; from < end;) {
    const int kind = seen_.far[from].kind.kind, level = nodes[seen_.far[from].target].level;
    std::size_t columns = 1;
    while (columns < kColumns && from + columns < end && seen_.far[from + columns].kind.kind == kind &&
           nodes[seen_.far[from + columns].target].level == level)
      ++columns;
    if (sources_->levels()[static_cast<std::size_t>(level)].orderOf(kind).single()) {
      farColumns(from, columns, up, down, single_x, single_y);
    } else {
      farColumns(from, columns, up, down, x, y);
    }
    from += columns;
  }
}

FastSources::Values FastSum::passAcross(const FastSources::Weighted& weighted) const {
  const std::vector<OctreeNode>& nodes = targets_->nodes();
  const Interactions::Lists& lists = seen_.to_nodes;
  Values down(down_first_.back(), 0.0);
  parallelBlocks(seen_.far_first.size() - 1, 1, options().threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t group = begin; group < end; ++group) farGroup(group, weighted.up, down);
  });
  parallelBlocks(nodes.size(), 16, options().threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      if (lists.first[n] == lists.first[n + 1]) continue;
      const Gathered<double> at = nodesOf(sources_->chebyshevOf(nodes[n]), *targets_, nodes[n]);
      const bool single = std::isinf(options().single_error);
      const Vec3 middle = targets_->middleOf(nodes[n]);
      Gathered<float> near_at, points;
      if (single) near_at.add(at.points(), nullptr, middle);
      for (std::uint32_t i = lists.first[n]; i < lists.first[n + 1]; ++i) {
        const OctreeNode& source = sources_->tree().nodes()[lists.source[i]];
        const double* const weights = weighted.sorted.data() + source.first;
        if (single) {
          points.add(sources_->tree().points(source), weights, middle);
        } else {
          addDistances(at.points(), sources_->tree().points(source), weights, down.data() + down_first_[n]);
        }
      }
      if (single) addDistances(near_at.points(), points.points(), points.w.data(), down.data() + down_first_[n]);
    }
  });
  return down;
}

void FastSum::passDown(Values& down) const {
  const Octree& tree = *targets_;
  for (int at = FastSources::kFirstFar; at <= tree.depth(); ++at) {
    const FastSources::Level& level = sources_->levels()[static_cast<std::size_t>(at)];
    eachOfLevel(tree, at, options().threads, [&](std::size_t n) {
      double* const own = down.data() + down_first_[n];
      const OctreeNode& node = tree.nodes()[n];
      sources_->chebyshevOf(node).fromTerms(own + level.terms, own);
      for (std::int32_t c = 0; c < node.child_count; ++c) {
        const std::size_t child = static_cast<std::size_t>(node.children + c);
        const OctreeNode& to = tree.nodes()[child];
        sources_->levelOf(to).octants->toFine(octantOf(to), own, down.data() + down_first_[child]);
      }
    });
  }
}

template <class Use>
void FastSum::eachLeaf(const FastSources::Weighted& weighted, const Use& use) const {
  const std::vector<OctreeNode>& nodes = targets_->nodes();
  const Interactions::Lists &near = seen_.near, &from_nodes = seen_.from_nodes;
  parallelBlocks(nodes.size(), 8, options().threads, [&](std::size_t begin, std::size_t end) {
    Gathered<double> wide;
    Gathered<float> narrow;
    for (std::size_t n = begin; n < end; ++n) {
      const OctreeNode& node = nodes[n];
      if (!node.leaf() || node.count == 0) continue;
      const Vec3 middle = targets_->middleOf(node);
      wide.clear(), narrow.clear();
      const auto gather = [&](auto& into) {
        for (std::uint32_t i = near.first[n]; i < near.first[n + 1]; ++i) {
          const OctreeNode& source = sources_->tree().nodes()[near.source[i]];
          into.add(sources_->tree().points(source), weighted.sorted.data() + source.first, middle);
        }
        for (std::uint32_t i = from_nodes.first[n]; i < from_nodes.first[n + 1]; ++i) {
          const std::size_t source = from_nodes.source[i];
          const OctreeNode& cube = sources_->tree().nodes()[source];
          const Gathered<double> at = nodesOf(sources_->chebyshevOf(cube), sources_->tree(), cube);
          into.add(at.points(), weighted.up.data() + sources_->first()[source], middle);
        }
      };
      if (std::isinf(options().single_error)) {
        gather(narrow);
      } else {
        gather(wide);
        if (options().single_error > 0 && singleError(wide, targets_->halfOf(node.level)) <= options().single_error) {
          narrow.addAll(wide);
          wide.clear();
        }
      }
      use(n, middle, wide, narrow);
    }
  });
}

void FastSum::values(const FastSources::Weighted& weighted, std::span<double> out) const {
  Values down = passAcross(weighted);
  passDown(down);
  eachLeaf(weighted, [&](std::size_t n, const Vec3& m, const Gathered<double>& wide, const Gathered<float>& narrow) {
    const OctreeNode& node = targets_->nodes()[n];
    const PointArrays<double> points = targets_->points(node);
    std::vector<double> sums(node.count, 0.0);
    const double middle[3] = {m.x, m.y, m.z};
    if (node.level >= FastSources::kFirstFar)
      sources_->chebyshevOf(node).spread(down.data() + down_first_[n], middle, targets_->halfOf(node.level), points,
                                         sums.data());
    Gathered<double> own;
    own.add(points, nullptr, m);
    if (!wide.x.empty()) addDistances(own.points(), wide.points(), wide.w.data(), sums.data());
    if (!narrow.x.empty()) {
      Gathered<float> single;
      single.add(points, nullptr, m);
      addDistances(single.points(), narrow.points(), narrow.w.data(), sums.data());
    }
    for (std::size_t i = 0; i < node.count; ++i) out[targets_->order()[node.first + i]] = sums[i];
  });
}

void FastSum::gradients(const FastSources::Weighted& weighted, std::span<Vec3> out) const {
  Values down = passAcross(weighted);
  passDown(down);
  eachLeaf(weighted, [&](std::size_t n, const Vec3& m, const Gathered<double>& wide, const Gathered<float>& narrow) {
    const OctreeNode& node = targets_->nodes()[n];
    const PointArrays<double> points = targets_->points(node);
    std::vector<double> x(node.count, 0.0), y = x, z = x;
    const double middle[3] = {m.x, m.y, m.z};
    if (node.level >= FastSources::kFirstFar)
      sources_->chebyshevOf(node).spreadGradient(down.data() + down_first_[n], middle, targets_->halfOf(node.level),
                                                 points, x.data(), y.data(), z.data());
    Gathered<double> own;
    own.add(points, nullptr, m);
    if (!wide.x.empty()) addDirections(own.points(), wide.points(), wide.w.data(), x.data(), y.data(), z.data());
    if (!narrow.x.empty()) {
      Gathered<float> single;
      single.add(points, nullptr, m);
      addDirections(single.points(), narrow.points(), narrow.w.data(), x.data(), y.data(), z.data());
    }
    for (std::size_t i = 0; i < node.count; ++i) out[targets_->order()[node.first + i]] = {x[i], y[i], z[i]};
  });
}

}  // namespace spinaltap::rbf
