#include "core/mesh/follow.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>

namespace spinaltap::mesh {
namespace {

constexpr std::size_t kMostNodes = 20'000'000;

/// A cube is named by its low corner; these are its nodes from there: eight corners and the middle.
constexpr std::array<Node, 9> kCube{
    {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {2, 2, 0}, {0, 0, 2}, {2, 0, 2}, {0, 2, 2}, {2, 2, 2}, {1, 1, 1}}};

std::string textOf(const Vec3& at) {
  char text[96];
  std::snprintf(text, sizeof text, "(%.6g, %.6g, %.6g)", at.x, at.y, at.z);
  return text;
}

class Follower {
 public:
  Follower(const Field& field, const Lattice& lattice, const std::function<void(double)>& progress)
      : field_(field), lattice_(lattice), progress_(progress) {}

  Result<Cloud> run(std::span<const Vec3> seeds) {
    const auto cubes = cubesOf(seeds);
    if (!cubes) return tl::unexpected(cubes.error());
    for (const Key cube : *cubes) wantCube(nodeOf(cube));
    if (auto ok = wave(); !ok) return tl::unexpected(ok.error());
    std::vector<Key> missed;
    for (const Key cube : *cubes) {
      if (!isCrossed(nodeOf(cube))) missed.push_back(cube);
    }
    std::vector<Node> pointed;
    for (const Key cube : missed) {
      pointed.push_back(pointedTo(nodeOf(cube)));
      wantCube(pointed.back());
    }
    if (auto ok = wave(); !ok) return tl::unexpected(ok.error());
    for (std::size_t i = 0; i < missed.size(); ++i) {
      if (!isCrossed(pointed[i])) wantAround(nodeOf(missed[i]));
    }
    while (!wanted_.empty()) {
      if (auto ok = wave(); !ok) return tl::unexpected(ok.error());
    }
    if (!crossed_) return fail(ErrorCode::NotFound, "no surface near any seed");
    sortByKey();
    joinNeighbours();
    return std::move(cloud_);
  }

 private:
  [[nodiscard]] Result<std::vector<Key>> cubesOf(std::span<const Vec3> seeds) const {
    std::vector<Key> cubes;
    for (const Vec3& seed : seeds) {
      if (!isFinite(seed)) return fail(ErrorCode::NotFinite, "a polygonise seed is not finite");
      const Vec3 at = (seed - lattice_.low_patient) / (2 * lattice_.half_mm);
      // Compared as doubles: a far seed must not overflow an int.
      if (!(at.x >= 0 && at.y >= 0 && at.z >= 0)) continue;
      if (!(2 * at.x < lattice_.last.x && 2 * at.y < lattice_.last.y && 2 * at.z < lattice_.last.z)) continue;
      cubes.push_back(keyOf({2 * static_cast<int>(at.x), 2 * static_cast<int>(at.y), 2 * static_cast<int>(at.z)}));
    }
    std::sort(cubes.begin(), cubes.end());
    cubes.erase(std::unique(cubes.begin(), cubes.end()), cubes.end());
    return cubes;
  }

  void want(Key key) {
    std::uint32_t& number = numbers_.at(key);
    if (number != NodeMap::kNone) return;
    number = kWanted;
    wanted_.push_back(key);
  }
  void wantCube(const Node& low) {
    for (const Node& n : kCube) {
      if (lattice_.holds(low + n)) want(keyOf(low + n));
    }
  }
  void wantAround(const Node& low) {
    for (int n = 0; n < 27; ++n) wantCube(low + Node{2 * (n % 3) - 2, 2 * (n / 3 % 3) - 2, 2 * (n / 9) - 2});
  }

  [[nodiscard]] double valueAt(const Node& n) {
    if (!lattice_.holds(n)) return 1;
    const std::uint32_t number = numbers_.at(keyOf(n));
    return number < kWanted ? cloud_.values[number] : 1;
  }
  [[nodiscard]] bool isCrossed(const Node& low) {
    const bool first = valueAt(low) < 0;
    return std::any_of(kCube.begin(), kCube.end(), [&](const Node& n) { return (valueAt(low + n) < 0) != first; });
  }

  /// The cube in which the values at an uncrossed cube's nodes say that the surface lies; at most one cube away.
  [[nodiscard]] Node pointedTo(const Node& low) {
    Vec3 slope;  // per cube's side
    for (std::size_t c = 0; c < 8; ++c) {
      const double value = valueAt(low + kCube[c]) / 4;
      slope += Vec3{(c & 1) != 0 ? value : -value, (c & 2) != 0 ? value : -value, (c & 4) != 0 ? value : -value};
    }
    const Vec3 way = slope * (-valueAt(low + kCube[8]) / dot(slope, slope));
    if (!isFinite(way)) return low;
    const auto sides = [](double w) { return 2 * static_cast<int>(std::floor(0.5 + std::clamp(w, -1.0, 1.0))); };
    const Node to = low + Node{sides(way.x), sides(way.y), sides(way.z)};
    return lattice_.holds(to) ? to : low;
  }

  /// Asks the field at all wanted nodes, then wants the ring around every crossed edge that they complete.
  Result<void> wave() {
    if (cloud_.keys.size() + wanted_.size() > kMostNodes) {
      return fail(ErrorCode::Limit, "the surface needs more than 20 million nodes at this cell size");
    }
    std::sort(wanted_.begin(), wanted_.end());
    std::vector<Vec3> points;
    points.reserve(wanted_.size());
    for (const Key key : wanted_) points.push_back(lattice_.place(nodeOf(key)));
    const std::size_t before = cloud_.values.size();
    cloud_.values.resize(before + points.size());
    if (!points.empty()) field_.values(points, std::span(cloud_.values).subspan(before));
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!std::isfinite(cloud_.values[before + i])) return notFinite(points[i]);
      numbers_.at(wanted_[i]) = static_cast<std::uint32_t>(before + i);
    }
    cloud_.keys.insert(cloud_.keys.end(), wanted_.begin(), wanted_.end());
    wanted_.clear();
    for (std::size_t i = before; i < cloud_.keys.size(); ++i) {
      if (auto ok = stepOver(i); !ok) return ok;
    }
    waves_ += 1;
    if (progress_) progress_(waves_ / (waves_ + 4.0));
    return {};
  }

  /// An edge whose both ends are new is met twice; the second time its ring is wanted already.
  Result<void> stepOver(std::size_t number) {
    const Node node = nodeOf(cloud_.keys[number]);
    const bool inside = cloud_.values[number] < 0;
    for (int d = 0; d < kSteps; ++d) {
      const Node other = node + kStep[static_cast<std::size_t>(d)];
      if (!lattice_.holds(other)) continue;
      const std::uint32_t at = numbers_.at(keyOf(other));
      if (at >= kWanted || (cloud_.values[at] < 0) == inside) continue;
      crossed_ = true;
      const Node& from = d < kForward ? node : other;
      const EdgeRing& ring = kEdgeRing[static_cast<std::size_t>(d % kForward)];
      for (int r = 0; r < ring.count; ++r) {
        const Node next = from + ring.around[static_cast<std::size_t>(r)];
        if (!lattice_.holds(next)) {
          return fail(ErrorCode::InvalidArgument,
                      "the surface leaves the polygonise box at " + textOf(lattice_.place(node)) + " mm");
        }
        want(keyOf(next));
      }
    }
    return {};
  }

  void sortByKey() {
    std::vector<std::uint32_t> order(cloud_.keys.size());
    std::iota(order.begin(), order.end(), 0U);
    std::sort(order.begin(), order.end(), [&](auto a, auto b) { return cloud_.keys[a] < cloud_.keys[b]; });
    std::vector<Key> keys;
    std::vector<double> values;
    keys.reserve(order.size()), values.reserve(order.size());
    for (const std::uint32_t from : order) {
      numbers_.at(cloud_.keys[from]) = static_cast<std::uint32_t>(keys.size());
      keys.push_back(cloud_.keys[from]), values.push_back(cloud_.values[from]);
    }
    cloud_.keys = std::move(keys), cloud_.values = std::move(values);
  }

  void joinNeighbours() {
    std::array<std::uint32_t, kSteps> nobody{};
    nobody.fill(NodeMap::kNone);
    cloud_.around.assign(cloud_.keys.size(), nobody);
    NodeMap::Reader reader(numbers_);
    for (std::uint32_t n = 0; n < cloud_.keys.size(); ++n) {
      const Node node = nodeOf(cloud_.keys[n]);
      for (std::size_t d = 0; d < kForward; ++d) {
        const Node other = node + kStep[d];
        const std::uint32_t at = lattice_.holds(other) ? reader.at(keyOf(other)) : NodeMap::kNone;
        if (at == NodeMap::kNone) continue;
        cloud_.around[n][d] = at;
        cloud_.around[at][d + kForward] = n;
      }
    }
  }

  static constexpr std::uint32_t kWanted = NodeMap::kNone - 1;  ///< in the next wave

  const Field& field_;
  const Lattice& lattice_;
  const std::function<void(double)>& progress_;
  Cloud cloud_;
  NodeMap numbers_;  ///< key -> its place in the cloud
  std::vector<Key> wanted_;
  bool crossed_ = false;
  double waves_ = 0;
};

}  // namespace

tl::unexpected<Error> notFinite(const Vec3& at_patient) {
  return fail(ErrorCode::NotFinite, "the field is not finite at " + textOf(at_patient) + " mm");
}

Result<Cloud> follow(const Field& field, const Lattice& lattice, std::span<const Vec3> seeds_patient,
                     const std::function<void(double)>& progress) {
  return Follower(field, lattice, progress).run(seeds_patient);
}

}  // namespace spinaltap::mesh
