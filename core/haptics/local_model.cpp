#include "core/haptics/local_model.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/base/dmath.h"

namespace spinaltap::haptics {
namespace {

constexpr int kMostSteps = 24;         // of a period: through all that is told, and as much again before it
constexpr double kShortest_mm = 0.01;  // of a step
constexpr double kOpen_mm = 5;         // of one where nothing is told
constexpr double kBehind_mm = 0.05;    // facets look a spacing ahead, so a bit behind by less meets what this one met

/// How far a bit may go in one step, so that it comes past no depth that is told without being asked there.
double stepFrom_mm(double ahead_mm) {
  if (ahead_mm < -kBehind_mm - 1e-9) return std::max(kShortest_mm, -kBehind_mm - ahead_mm);
  for (std::size_t i = 0; i < kDepthsAhead; ++i) {
    const double half = i == 0 ? 0.0 : 0.5 * (kAhead_mm[i - 1] + kAhead_mm[i]);  // where a wall may begin
    for (const double depth : {half, kAhead_mm[i]}) {
      if (ahead_mm < depth - 1e-9) return std::max(kShortest_mm, depth - ahead_mm);
    }
  }
  return kOpen_mm;
}

using Directions = std::array<SinCos, kLocalSides>;
Directions directions() {
  Directions directions;
  for (std::size_t i = 0; i < kLocalSides; ++i) directions[i] = sinCosOfTurn(static_cast<int>(i), kLocalSides);
  return directions;
}

}  // namespace

LocalModel localModel(const Rod& bit, const Meeting& meeting, const std::array<double, kDepthsAhead>& frontal_mm2) {
  LocalModel model;
  model.bit = bit;
  for (std::size_t i = 0; i < kDepthsAhead; ++i) model.frontal_mm2[i] = static_cast<float>(frontal_mm2[i]);
  model.rubbing_mm2 = static_cast<float>(meeting.rubbing_mm2);
  std::array<double, kLocalSides> area{}, lever{};
  const Directions directed = directions();
  for (std::size_t n = 0; n < meeting.side_count; ++n) {
    const SideContact& side = meeting.sides[n];
    std::size_t nearest = 0;
    double best = -2;
    for (std::size_t i = 0; i < kLocalSides; ++i) {
      const SinCos& at = directed[i];
      const double along = side.x * at.cos + side.y * at.sin;
      if (along > best) best = along, nearest = i;
    }
    area[nearest] += side.area_mm2, lever[nearest] += side.area_mm2 * side.lever;
  }
  for (std::size_t i = 0; i < kLocalSides; ++i) {
    model.side_mm2[i] = static_cast<float>(area[i]);
    model.side_lever[i] = area[i] > 0 ? static_cast<float>(lever[i] / area[i]) : 0.0F;
  }
  return model;
}

Meeting meetingOf(const LocalModel& model, double ahead_mm, bool spinning) {
  Meeting meeting;
  const double at = std::min(std::max(ahead_mm, kAhead_mm.front()), kAhead_mm.back());
  std::size_t i = 1;
  while (i + 1 < kDepthsAhead && at > kAhead_mm[i]) ++i;
  const double between = (at - kAhead_mm[i - 1]) / (kAhead_mm[i] - kAhead_mm[i - 1]);
  const double part = spinning ? between : between < 0.5 ? 0.0 : 1.0;
  const double from = model.frontal_mm2[i - 1], to = model.frontal_mm2[i];
  // Behind where the server's bit stood there is a hole.
  meeting.frontal_mm2 = ahead_mm < -kBehind_mm ? 0.0 : from + part * (to - from);
  meeting.rubbing_mm2 = model.rubbing_mm2;
  const Directions directed = directions();
  for (std::size_t n = 0; n < kLocalSides; ++n) {
    if (!(model.side_mm2[n] > 0)) continue;
    const SinCos& direction = directed[n];
    meeting.sides[meeting.side_count++] = {direction.cos, direction.sin, model.side_lever[n], model.side_mm2[n]};
  }
  return meeting;
}

void LocalBit::place(const Rod& hand) {
  proxy_.place(hand);
  hand_ = hand;
  learnt_ = false;
  missing_mm_ = made_good_mm_ = {};
  past_ = {};
}

void LocalBit::reckon(double seconds, double reserve_mJ) {
  // Implicit, so that a period longer than the reckoning makes good all that is missing and no more.
  Vec3 move = missing_mm_ * (seconds / (seconds + kReckoning_s));
  const Vec3 stretched = hand_.tip_mm - proxy_.rod().tip_mm;
  // The spring's energy K/2 (stretched - part * move)^2 may grow by what is in reserve beyond what it holds already,
  // which the hand will get back: a quadratic in the part.
  const double a = dot(move, move), b = -dot(stretched, move);
  const double room = std::max(0.0, 2 * reserve_mJ / proxy_.coupling().stiffness_N_mm - dot(stretched, stretched));
  if (a + 2 * b > room) move *= (std::sqrt(b * b + a * room) - b) / a;
  Rod rod = proxy_.rod();
  rod.tip_mm += move;
  made_good_mm_ += move;
  missing_mm_ -= move;
  proxy_.place(rod);
}

Reaction LocalBit::step(std::uint32_t seq, const Rod& hand, double seconds, bool spinning, double reserve_mJ) {
  Reaction reaction;
  double left = 1.0;
  for (int n = 0; n < kMostSteps && left > 0; ++n) {
    const double ahead_mm = dot(proxy_.rod().tip_mm - model_.bit.tip_mm, proxy_.rod().axis);
    const Meeting meeting = learnt_ ? meetingOf(model_, ahead_mm, spinning) : Meeting{};
    reaction = proxy_.step(hand_, hand, meeting, {left * seconds, spinning, stepFrom_mm(ahead_mm), 0});
    left *= 1.0 - reaction.done;
  }
  hand_ = hand;
  reckon(seconds, reserve_mJ);
  past_[seq % kMostRemembered] = {seq, true, proxy_.rod().tip_mm - made_good_mm_};
  return reaction;
}

void LocalBit::learn(std::uint32_t seq, const LocalModel& model) {
  if (learnt_ && static_cast<std::int32_t>(seq - learnt_seq_) <= 0) return;
  const Past& past = past_[seq % kMostRemembered];
  if (!past.known || past.seq != seq) return;
  model_ = model;
  learnt_ = true;
  learnt_seq_ = seq;
  missing_mm_ = model.bit.tip_mm - (past.own_mm + made_good_mm_);
}

}  // namespace spinaltap::haptics
