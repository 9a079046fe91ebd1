#include "core/rbf/subdomains.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/base/box.h"
#include "core/base/parallel.h"

namespace spinaltap::rbf {
namespace {

double squaredDistance(const Box& a, const Vec3& p) {
  const double x = std::max({a.low.x - p.x, 0.0, p.x - a.high.x}), y = std::max({a.low.y - p.y, 0.0, p.y - a.high.y}),
               z = std::max({a.low.z - p.z, 0.0, p.z - a.high.z});
  return x * x + y * y + z * z;
}

double squaredDistance(const Box& a, const Box& b) {
  const double x = std::max({a.low.x - b.high.x, 0.0, b.low.x - a.high.x}),
               y = std::max({a.low.y - b.high.y, 0.0, b.low.y - a.high.y}),
               z = std::max({a.low.z - b.high.z, 0.0, b.low.z - a.high.z});
  return x * x + y * y + z * z;
}

/// A tree of halves.
class Halves {
 public:
  Halves(std::span<const Vec3> points, std::size_t most) : points_(points), order_(points.size()) {
    std::iota(order_.begin(), order_.end(), 0U);
    split(0, order_.size(), most);
  }

  struct Node {
    Box box;
    std::size_t begin, end;
    std::size_t left = 0, right = 0;  ///< 0: a leaf
  };

  [[nodiscard]] const std::vector<Node>& nodes() const { return nodes_; }
  [[nodiscard]] std::span<const std::uint32_t> pointsOf(const Node& n) const {
    return {order_.data() + n.begin, n.end - n.begin};
  }

  /// Calls use(index, squared distance) for the points within a distance of a box.
  template <class Use>
  void eachNear(const Box& box, double squared, const Use& use, std::size_t at = 0) const {
    const Node& node = nodes_[at];
    if (squaredDistance(node.box, box) > squared) return;
    if (node.left != 0) {
      eachNear(box, squared, use, node.left);
      eachNear(box, squared, use, node.right);
      return;
    }
    for (const std::uint32_t i : pointsOf(node)) {
      const double d = squaredDistance(box, points_[i]);
      if (d <= squared) use(i, d);
    }
  }

 private:
  std::size_t split(std::size_t begin, std::size_t end, std::size_t most) {
    const std::size_t own = nodes_.size();
    nodes_.push_back({boxOf(begin, end), begin, end});
    if (end - begin <= most) return own;
    const Vec3 size = nodes_[own].box.high - nodes_[own].box.low;
    const auto along = [&](std::uint32_t i) {
      const Vec3& p = points_[i];
      return size.x >= size.y && size.x >= size.z ? p.x : size.y >= size.z ? p.y : p.z;
    };
    const auto at = [&](std::size_t n) { return order_.begin() + static_cast<std::ptrdiff_t>(n); };
    const std::size_t middle = begin + (end - begin) / 2;
    std::nth_element(at(begin), at(middle), at(end), [&](std::uint32_t a, std::uint32_t b) {
      return along(a) != along(b) ? along(a) < along(b) : a < b;
    });
    const std::size_t left = split(begin, middle, most);
    const std::size_t right = split(middle, end, most);
    nodes_[own].left = left, nodes_[own].right = right;
    return own;
  }

  [[nodiscard]] Box boxOf(std::size_t begin, std::size_t end) const {
    Box box{points_[order_[begin]], points_[order_[begin]]};
    for (std::size_t n = begin; n < end; ++n) box.add(points_[order_[n]]);
    return box;
  }

  std::span<const Vec3> points_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

struct Near {
  double squared;
  std::uint32_t index;
  friend bool operator<(const Near& a, const Near& b) {
    return a.squared != b.squared ? a.squared < b.squared : a.index < b.index;
  }
};

Subdomain grown(const Halves& halves, const Halves::Node& leaf, std::size_t whole, std::size_t all) {
  Subdomain out;
  const auto own = halves.pointsOf(leaf);
  out.points.assign(own.begin(), own.end());
  out.inner = own.size();
  const std::size_t wanted = std::min(whole, all);
  if (wanted <= out.inner) return out;
  // Points around a box on a surface grow with its width: a third of it to begin with, then twice as far.
  double reach = std::max(norm(leaf.box.high - leaf.box.low) / 3, std::numeric_limits<double>::min());
  std::vector<Near> near;
  while (near.size() < wanted) {
    near.clear();
    halves.eachNear(leaf.box, reach * reach, [&](std::uint32_t i, double squared) { near.push_back({squared, i}); });
    reach *= 2;
  }
  std::vector<std::uint32_t> mine(own.begin(), own.end());
  std::sort(mine.begin(), mine.end());
  std::erase_if(near, [&](const Near& n) { return std::binary_search(mine.begin(), mine.end(), n.index); });
  const std::size_t more = wanted - out.inner;
  if (near.size() > more) {
    std::nth_element(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(more), near.end());
    near.resize(more);
  }
  std::sort(near.begin(), near.end());
  for (const Near& n : near) out.points.push_back(n.index);
  return out;
}

}  // namespace

std::vector<Subdomain> someSubdomains(std::span<const Vec3> points, std::size_t inner, std::size_t whole,
                                      std::size_t most) {
  const Halves halves(points, inner);
  std::vector<std::size_t> leaves;
  for (std::size_t n = 0; n < halves.nodes().size(); ++n) {
    if (halves.nodes()[n].left == 0) leaves.push_back(n);
  }
  std::vector<Subdomain> out(std::min(most, leaves.size()));
  parallelBlocks(out.size(), 4, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      const std::size_t leaf = leaves[n * leaves.size() / out.size()];
      out[n] = grown(halves, halves.nodes()[leaf], whole, points.size());
    }
  });
  return out;
}

std::vector<Subdomain> cutIntoSubdomains(std::span<const Vec3> points, std::size_t inner, std::size_t whole) {
  return someSubdomains(points, inner, whole, points.size());
}

std::vector<std::uint32_t> thinOut(std::span<const Vec3> points, const std::vector<Subdomain>& boxes, double share) {
  std::vector<std::uint32_t> out;
  for (const Subdomain& box : boxes) {
    const std::size_t wanted =
        std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(static_cast<double>(box.inner) / share)));
    std::vector<double> distance(box.inner, std::numeric_limits<double>::infinity());
    std::size_t next = 0;
    for (std::size_t n = 0; n < wanted; ++n) {
      out.push_back(box.points[next]);
      std::size_t farthest = 0;
      for (std::size_t i = 0; i < box.inner; ++i) {
        const Vec3 d = points[box.points[i]] - points[box.points[next]];
        distance[i] = std::min(distance[i], dot(d, d));
        if (distance[i] > distance[farthest]) farthest = i;
      }
      next = farthest;
    }
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

}  // namespace spinaltap::rbf
