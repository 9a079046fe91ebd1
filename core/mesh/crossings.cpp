#include "core/mesh/crossings.h"

#include <algorithm>
#include <cmath>

namespace spinaltap::mesh {
namespace {

constexpr double kRootTolerance = 1e-3;  // of an edge: how far the last secant may still have moved
constexpr std::uint8_t kLevels = 64;     // nodes move in the order of their nearness, told apart this finely

/// Whether a node's side keeps its shape without it: its neighbours of that side hang together around it, and so do all
/// others ("simple point": Bertrand, "Simple points, topological numbers and geodesic neighborhoods", 1994).
bool mayLeave(Neighbours alike) {
  static const std::vector<bool> kTable = [] {
    std::vector<bool> table;
    for (unsigned set = 0; set <= kAllNeighbours; ++set) {
      const auto own = static_cast<Neighbours>(set), others = static_cast<Neighbours>(kAllNeighbours & ~set);
      table.push_back(isOnePiece(own) && isOnePiece(others));
    }
    return table;
  }();
  return kTable[alike];
}

}  // namespace

CrossingFinder::CrossingFinder(const Field& field, const Lattice& lattice, const Cloud& cloud)
    : field_(field), lattice_(lattice), cloud_(cloud), held_(cloud.keys.size(), false) {
  listEdges();
  moveNodes();
}

Result<void> CrossingFinder::refine(const std::function<void(double)>& progress) {
  for (std::vector<std::uint32_t> open = openEdges(); !open.empty() && rounds_ < kMostRounds; open = openEdges()) {
    // The nodes are moved anew when few are left to ask, so that those which then become vertices join them.
    for (const std::size_t few = open.size() / 8; !open.empty() && rounds_ < kMostRounds && open.size() >= few;) {
      if (auto ok = ask(open); !ok) return ok;
      std::erase_if(open, [this](std::uint32_t e) { return found_[e]; });
      rounds_ += 1;
      if (progress) progress(rounds_ / (rounds_ + 2.0));
    }
    moveNodes();  // some crossings turned out nearer or farther than they were estimated
  }
  return {};
}

void CrossingFinder::hold(std::span<const std::uint32_t> nodes) {
  for (const std::uint32_t node : nodes) held_[node] = true;
  moveNodes();
}

void CrossingFinder::listEdges() {
  for (std::uint32_t n = 0; n < cloud_.keys.size(); ++n) {
    made_.first.push_back(static_cast<std::uint32_t>(made_.from.size()));
    made_.mask.push_back(0);
    for (std::size_t d = 0; d < kForward; ++d) {
      const std::uint32_t other = cloud_.around[n][d];
      if (other == NodeMap::kNone || (cloud_.values[other] < 0) == (cloud_.values[n] < 0)) continue;
      made_.mask.back() = static_cast<std::uint8_t>(made_.mask.back() | 1U << d);
      addEdge(n, other, isLong(static_cast<int>(d)));
    }
  }
  made_.first.push_back(static_cast<std::uint32_t>(made_.from.size()));
  alike_.assign(cloud_.keys.size(), kAllNeighbours);
  for (std::uint32_t n = 0; n < cloud_.keys.size(); ++n) {
    for (std::size_t d = 0; d < kForward; ++d) {
      if ((made_.mask[n] >> d & 1U) == 0) continue;
      alike_[n] = static_cast<Neighbours>(alike_[n] & ~(1U << d));
      Neighbours& other = alike_[cloud_.around[n][d]];
      other = static_cast<Neighbours>(other & ~(1U << (d + kForward)));
    }
  }
}

void CrossingFinder::addEdge(std::uint32_t from, std::uint32_t to, bool is_long) {
  made_.from.push_back(from), made_.to.push_back(to);
  brackets_.push_back({0, 1, cloud_.values[from], cloud_.values[to]});
  snap_.push_back(is_long ? kSnapLong : kSnapShort);
  made_.share.push_back(aim(brackets_.back()));
  level_.push_back(levelOf(static_cast<std::uint32_t>(level_.size())));
  found_.push_back(false);
}

/// Halved first: the difference of two huge values must not overflow.
double CrossingFinder::aim(const Bracket& b) {
  const double low = b.at_low / 2, high = b.at_high / 2;
  const double share = low / (low - high);
  return b.low + (b.high - b.low) * (std::isfinite(share) ? share : 0.5);
}

/// kLevels for a crossing that is too far from both ends to move either.
std::uint8_t CrossingFinder::levelOf(std::uint32_t edge) const {
  const double nearness = std::min(made_.share[edge], 1 - made_.share[edge]) / snap_[edge];
  if (nearness > 1) return kLevels;
  return std::min<std::uint8_t>(kLevels - 1, static_cast<std::uint8_t>(nearness * kLevels));
}

/// Decided afresh from what is known of all crossings: the nearest nodes first, and none whose edge's other end did.
void CrossingFinder::moveNodes() {
  made_.carrier.assign(cloud_.keys.size(), NodeMap::kNone);
  std::array<std::size_t, kLevels + 2> first{};
  for (const std::uint8_t level : level_) ++first[level + 1U];
  for (std::size_t level = 0; level <= kLevels; ++level) first[level + 1] += first[level];
  std::vector<std::uint32_t> order(first[kLevels]);
  for (std::uint32_t e = 0; e < level_.size(); ++e) {
    if (level_[e] < kLevels) order[first[level_[e]]++] = e;
  }
  std::vector<Neighbours> alike = alike_;
  for (const std::uint32_t e : order) {
    const std::uint32_t near_end = made_.share[e] < 0.5 ? made_.from[e] : made_.to[e];
    if (!made_.isCut(e) || held_[near_end] || !mayLeave(alike[near_end])) continue;
    made_.carrier[near_end] = e;
    for (std::size_t d = 0; d < kSteps; ++d) {
      const std::uint32_t other = cloud_.around[near_end][d];
      if (other == NodeMap::kNone) continue;
      const std::size_t back = (d + kForward) % kSteps;
      alike[other] = static_cast<Neighbours>(alike[other] & ~(1U << back));
    }
  }
}

std::vector<std::uint32_t> CrossingFinder::openEdges() const {
  std::vector<std::uint32_t> open;
  for (std::uint32_t e = 0; e < found_.size(); ++e) {
    if (found_[e]) continue;
    const std::uint32_t from = made_.from[e], to = made_.to[e];
    if (made_.isCut(e) || made_.carrier[from] == e || made_.carrier[to] == e) open.push_back(e);
  }
  return open;
}

Result<void> CrossingFinder::ask(const std::vector<std::uint32_t>& open) {
  std::vector<Vec3> points;
  points.reserve(open.size());
  for (const std::uint32_t e : open) points.push_back(made_.place(cloud_, lattice_, e));
  std::vector<double> out(points.size());
  field_.values(points, out);
  for (std::size_t i = 0; i < open.size(); ++i) {
    if (!std::isfinite(out[i])) return notFinite(points[i]);
    narrow(open[i], out[i]);
  }
  return {};
}

/// False position with the Illinois rule: the value of an end that stays twice is halved.
void CrossingFinder::narrow(std::uint32_t edge, double value) {
  Bracket& b = brackets_[edge];
  const double before = made_.share[edge];
  if ((value < 0) == (b.at_low < 0)) {
    b.low = before, b.at_low = value;
    if (b.kept == 1) b.at_high /= 2;
    b.kept = 1;
  } else {
    b.high = before, b.at_high = value;
    if (b.kept == -1) b.at_low /= 2;
    b.kept = -1;
  }
  made_.share[edge] = aim(b);
  level_[edge] = levelOf(edge);
  found_[edge] =
      value == 0 || b.high - b.low <= kRootTolerance || std::abs(made_.share[edge] - before) <= kRootTolerance;
}

/// Only the cuts at held nodes can be too near.
Crossings CrossingFinder::crossings() const {
  Crossings out = made_;
  for (std::uint32_t e = 0; e < out.from.size(); ++e) {
    if (out.isCut(e)) out.share[e] = std::clamp(out.share[e], snap_[e], 1 - snap_[e]);
  }
  return out;
}

}  // namespace spinaltap::mesh
