#include "core/haptics/proxy.h"

#include <algorithm>
#include <cmath>

namespace spinaltap::haptics {
namespace {

constexpr int kMostRounds = 100;         // of Newton; a bound that ends it, whatever comes
constexpr double kNudge = 1e-12;         // of the way in the open, where the search sets off
constexpr double kShortestPart = 1e-13;  // of a step: one that runs into a wall head on is shortened to 2 / kSideWall
constexpr double kCreep_mm_s = 0.01;     // a side's threshold is reached at this velocity
constexpr double kRounding = 1e-16;      // of a sum, in parts of its terms
constexpr double kSideWall = 1e9;        // a bit that stands gives way by a billionth of the pull

/// Of tip and grip across the axis: tip x, tip y, grip x, grip y.
using Across = std::array<double, 4>;

Across weights(const SideContact& side) {
  const double tip = 1.0 - side.lever;
  return {side.x * tip, side.y * tip, side.x * side.lever, side.y * side.lever};
}

double product(const Across& a, const Across& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]; }

/// One side: what it answers to the rod's motion.
struct Side {
  Across weight{};
  double slope_N_s_mm = 0;  ///< once it cuts, or of a wall
  double steep_N_s_mm = 0;  ///< more than that, while it creeps: up to its threshold
  double creep_mm_s = 0;    ///< how fast it creeps at most

  Side() = default;
  Side(const SideContact& contact, const Drive& drive, bool spinning, double wall_N_s_mm) : weight(weights(contact)) {
    const Resistance side = sideResistance(contact.area_mm2, drive, spinning);
    slope_N_s_mm = side.wall ? wall_N_s_mm : side.slope_N_s_mm;
    steep_N_s_mm = std::min(side.threshold_N / kCreep_mm_s, wall_N_s_mm);
    creep_mm_s = std::max(kCreep_mm_s, side.threshold_N / wall_N_s_mm);
  }
  [[nodiscard]] double force_N(double approach_mm_s) const {
    return steep_N_s_mm * std::min(approach_mm_s, creep_mm_s) + slope_N_s_mm * approach_mm_s;
  }
};

/// Where the rod moves at some velocity: give v^2 / 2 - pull v + the sides' powers, a convex potential that is least
/// where everything balances; which way it falls, and how it bends (the lower half).
struct Balance {
  double potential = 0;
  Across falls{};
  std::array<Across, 4> bends{};
};

/// All sides together.
struct Sides {
  std::array<Side, kMostSides> side;
  std::size_t count;
  double give;  ///< of the springs, N s/mm

  Sides(const Meeting& meeting, const Drive& drive, bool spinning, double give_N_s_mm)
      : count(meeting.side_count), give(give_N_s_mm) {
    for (std::size_t i = 0; i < count; ++i) side[i] = Side(meeting.sides[i], drive, spinning, kSideWall * give);
  }

  [[nodiscard]] Balance balance(const Across& pull, const Across& v) const {
    Balance sum;
    sum.potential = 0.5 * give * product(v, v) - product(pull, v);
    for (std::size_t n = 0; n < 4; ++n) sum.bends[n][n] = give, sum.falls[n] = pull[n] - give * v[n];
    for (std::size_t i = 0; i < count; ++i) {
      const Side& one = side[i];
      const double approach = product(one.weight, v);
      if (!(approach > 0)) continue;
      const double creeping = std::min(approach, one.creep_mm_s), force_N = one.force_N(approach);
      const double slope = one.slope_N_s_mm + (approach < one.creep_mm_s ? one.steep_N_s_mm : 0.0);
      sum.potential +=
          one.steep_N_s_mm * creeping * (approach - 0.5 * creeping) + 0.5 * one.slope_N_s_mm * approach * approach;
      for (std::size_t n = 0; n < 4; ++n) {
        sum.falls[n] -= force_N * one.weight[n];
        for (std::size_t m = 0; m <= n; ++m) sum.bends[n][m] += slope * one.weight[n] * one.weight[m];
      }
    }
    return sum;
  }
  /// Their force on the rod; against every motion, for each side pushes back only where it is approached.
  [[nodiscard]] Across force(const Across& v) const {
    Across sum{};
    for (std::size_t i = 0; i < count; ++i) {
      const double approach = product(side[i].weight, v);
      if (!(approach > 0)) continue;
      const double force_N = side[i].force_N(approach);
      for (std::size_t n = 0; n < 4; ++n) sum[n] -= force_N * side[i].weight[n];
    }
    return sum;
  }
};

/// Solves A x = b for a positive definite A, of which the lower half is given; b becomes x.
void solve(std::array<Across, 4>& a, Across& b) {
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = a[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= a[i][k] * a[j][k];
      a[i][j] = i == j ? std::sqrt(sum) : sum / a[j][j];
    }
    for (std::size_t k = 0; k < i; ++k) b[i] -= a[i][k] * b[k];
    b[i] /= a[i][i];
  }
  for (std::size_t i = 4; i-- > 0;) {
    for (std::size_t k = i + 1; k < 4; ++k) b[i] -= a[k][i] * b[k];
    b[i] /= a[i][i];
  }
}

/// The velocities across the axis at which pulls and sides balance. Newton: the potential is a quadratic wherever no
/// side changes between free, creeping and cutting; where one does on the way, a step is shortened until the potential
/// falls.
Across velocityAcross(const Sides& sides, const Across& pull) {
  // Set off the way the springs pull, so that the sides on that way count from the first step on.
  Across v{};
  for (std::size_t n = 0; n < 4; ++n) v[n] = kNudge * pull[n] / sides.give;
  Balance here = sides.balance(pull, v);
  for (int round = 0; round < kMostRounds; ++round) {
    Across step = here.falls;
    solve(here.bends, step);
    // Half of that is what the step should gain; less than rounding leaves of the potential can't be seen.
    const double gain = product(here.falls, step);
    if (gain <= kRounding * (std::abs(here.potential) + std::abs(product(pull, v)))) break;
    bool moved = false;
    for (double part = 1.0; !moved && part > kShortestPart; part *= 0.5) {
      Across next = v;
      for (std::size_t n = 0; n < 4; ++n) next[n] += part * step[n];
      const Balance there = sides.balance(pull, next);
      moved = there.potential < here.potential;
      if (moved) v = next, here = there;
    }
    if (!moved || product(step, step) <= 1e-24 * product(v, v)) break;
  }
  return v;
}

/// Along the axis: the velocity, and what the bone answers (negative: against an advance).
double answerAhead(const Meeting& meeting, const Drive& drive, bool spinning, double give, double pull_N,
                   double& velocity_mm_s) {
  const double rubbing_N = kRubbing_N_mm2 * meeting.rubbing_mm2;
  Resistance resistance = pull_N > 0 ? tipResistance(meeting.frontal_mm2, drive, spinning) : Resistance{};
  resistance.threshold_N += rubbing_N;
  const double speed = advance_mm_s(resistance, std::abs(pull_N), give);
  const double force = speed > 0 ? resistance.threshold_N + resistance.slope_N_s_mm * speed : std::abs(pull_N);
  velocity_mm_s = pull_N > 0 ? speed : -speed;
  return pull_N > 0 ? -force : force;
}

/// Part of the way from one rod to another; the axis turns on the shortest arc, by no more than that part of its chord.
Rod between(const Rod& from, const Rod& to, double part) {
  if (!(part < 1.0)) return to;
  Vec3 tangent = to.axis - from.axis * dot(to.axis, from.axis);
  const double length = norm(tangent), chord = norm(to.axis - from.axis);
  tangent = length > 1e-6 ? tangent / length : toolX(from.axis);  // opposite: any way round
  return {from.tip_mm + (to.tip_mm - from.tip_mm) * part, normalized(from.axis + tangent * (part * chord))};
}

}  // namespace

double stiffestCoupling_N_mm(double device_damping_N_s_mm, double period_s, double damping_N_s_mm) {
  return std::max(0.0, 2.0 * (device_damping_N_s_mm - std::abs(damping_N_s_mm)) / period_s);
}

double boundedStiffness_N_mm(double wanted_N_mm, double device_damping_N_s_mm, double period_s, double damping_N_s_mm) {
  return std::min(wanted_N_mm,
                  kCouplingMargin * stiffestCoupling_N_mm(device_damping_N_s_mm, period_s, damping_N_s_mm));
}

// The rotation that takes z to the axis by the shortest way; beyond a right angle, the one that takes -z there.
Vec3 toolX(const Vec3& axis) {
  const double sign = axis.z < 0 ? -1.0 : 1.0, per = 1.0 / (1.0 + sign * axis.z);
  return {1.0 - axis.x * axis.x * per, -axis.x * axis.y * per, -sign * axis.x};
}
Vec3 toolY(const Vec3& axis) { return cross(axis, toolX(axis)); }

void Proxy::place(const Rod& rod) { rod_ = rod; }

Reaction Proxy::step(const Rod& before, const Rod& hand, const Meeting& meeting, const Step& step) {
  const bool free = meeting.side_count == 0 && !(meeting.frontal_mm2 > 0) && !(meeting.rubbing_mm2 > 0);
  return free ? stepFree(hand, step) : stepInBone(before, hand, meeting, step);
}

Reaction Proxy::carry(const Rod& hand, const Meeting& meeting, double feed_mm_s, bool spinning) {
  rod_ = hand;
  Reaction reaction;
  reaction.feed_mm_s = feed_mm_s;
  if (!(feed_mm_s > 0) || !spinning) return reaction;
  const Resistance tip = tipResistance(meeting.frontal_mm2, drive_, true);
  reaction.force_N.z = -(tip.threshold_N + tip.slope_N_s_mm * feed_mm_s);
  reaction.torque_Nmm.z = -torque_Nmm(meeting.frontal_mm2, drive_, feed_mm_s);
  return reaction;
}

Proxy::Pull Proxy::pull(const Rod& before, const Rod& hand, double seconds) const {
  const double k = coupling_.stiffness_N_mm, b = coupling_.damping_N_s_mm / seconds;
  return {(hand.tip_mm - rod_.tip_mm) * k + (hand.tip_mm - before.tip_mm) * b,
          (hand.grip_mm() - rod_.grip_mm()) * k + (hand.grip_mm() - before.grip_mm()) * b};
}

Reaction Proxy::stand(const Rod& before, const Rod& hand, double seconds) const {
  const Pull pulls = pull(before, hand, seconds);
  const Vec3 x = toolX(rod_.axis), y = toolY(rod_.axis);
  const double grip_x = dot(pulls.grip_N, x), grip_y = dot(pulls.grip_N, y);
  Reaction reaction;
  reaction.force_N = {-dot(pulls.tip_N, x) - grip_x, -dot(pulls.tip_N, y) - grip_y, -dot(pulls.tip_N, rod_.axis)};
  reaction.torque_Nmm = {-kGrip_mm * grip_y, kGrip_mm * grip_x, 0};
  return reaction;
}

Reaction Proxy::stepFree(const Rod& hand, const Step& step) {
  const double way_mm = norm(hand.tip_mm - rod_.tip_mm) + step.reach_mm * norm(hand.axis - rod_.axis);
  const double part = way_mm > step.longest_mm ? step.longest_mm / way_mm : 1.0;
  const Rod reached = between(rod_, hand, part);
  Reaction reaction;
  reaction.feed_mm_s = dot(reached.tip_mm - rod_.tip_mm, rod_.axis) / (step.seconds * part);
  reaction.done = part;
  rod_ = reached;
  return reaction;
}

Reaction Proxy::stepInBone(const Rod& before, const Rod& hand, const Meeting& meeting, const Step& step) {
  const double k = coupling_.stiffness_N_mm, b = coupling_.damping_N_s_mm, give = k * step.seconds + b;
  const Vec3 x = toolX(rod_.axis), y = toolY(rod_.axis), z = rod_.axis;
  const Pull pulls = pull(before, hand, step.seconds);

  Reaction reaction;
  const Sides sides(meeting, drive_, step.spinning, give);
  const Across velocity =
      velocityAcross(sides, {dot(pulls.tip_N, x), dot(pulls.tip_N, y), dot(pulls.grip_N, x), dot(pulls.grip_N, y)});
  const Across force = sides.force(velocity);
  const double ahead = answerAhead(meeting, drive_, step.spinning, give, dot(pulls.tip_N, z), reaction.feed_mm_s);
  reaction.force_N = {force[0] + force[2], force[1] + force[3], ahead};
  const double torque =
      step.spinning ? torque_Nmm(meeting.frontal_mm2, drive_, std::max(0.0, reaction.feed_mm_s)) : 0.0;
  // About the tip: the grip's force at -kGrip_mm along z.
  reaction.torque_Nmm = {kGrip_mm * force[3], -kGrip_mm * force[2], -torque};

  // No point moves farther than the step allows: of both ends' motion, all or the same part.
  const Vec3 tip_move = (x * velocity[0] + y * velocity[1] + z * reaction.feed_mm_s) * step.seconds;
  const Vec3 turn = (x * (velocity[2] - velocity[0]) + y * (velocity[3] - velocity[1])) * step.seconds;
  const double longest = norm(tip_move) + norm(turn) * (step.reach_mm / kGrip_mm);
  const double part = longest > step.longest_mm ? step.longest_mm / longest : 1.0;
  reaction.done = part;
  rod_.tip_mm += tip_move * part;
  rod_.axis = normalized(rod_.axis * kGrip_mm - turn * part);
  return reaction;
}

}  // namespace spinaltap::haptics
