#include "core/tradeoff/haptic_loop.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <optional>

#include "core/base/random.h"
#include "core/haptics/port.h"
#include "core/session/told_model.h"

namespace spinaltap::tradeoff {
namespace {

using point_volume::Lattice;
using point_volume::PointVolume;

constexpr double kTick_s = 5e-5;  // of the hand, and of the reference
constexpr double kSpacing_mm = 0.2, kRadius_mm = 2.4, kWallPull_mm = 3;
constexpr haptics::Approach kApproach;
constexpr std::size_t kMostWait = 100'000;  // ticks: 5 s, for delays of a second and losses
constexpr double kSlow_s = 0.1;             // what swings faster than that is no course

struct Layer {
  double thick_mm;
  std::uint16_t density_mg_cm3;
};
std::vector<Layer> layersOf(Bone bone) {
  switch (bone) {
    case Bone::Cortex:
      return {{8, 1150}};
    case Bone::Cancellous:
      return {{12, 250}};
    default:
      return {{1.2, 1000}, {3, 250}, {1.2, 1000}, {8, 0}};
  }
}

Result<PointVolume> boneOf(Bone bone) {
  const std::vector<Layer> layers = layersOf(bone);
  double length = 0;
  for (const Layer& layer : layers) length += layer.thick_mm;
  const Lattice lattice{kSpacing_mm, static_cast<int>(kRadius_mm / kSpacing_mm) + 1,
                        static_cast<int>(length / kSpacing_mm), 0};
  auto volume = point_volume::solidVolume(lattice, 1);
  if (!volume) return volume;
  for (std::uint32_t i = 0; i < lattice.points(); ++i) {
    double z = point_volume::positionOf(lattice, i).z + 0.5 * kSpacing_mm;
    std::size_t n = 0;
    while (n + 1 < layers.size() && z > layers[n].thick_mm) z -= layers[n++].thick_mm;
    volume->density_mg_cm3[i] = layers[n].density_mg_cm3;
    if (layers[n].density_mg_cm3 == 0) volume->alive[i >> 6] &= ~(std::uint64_t{1} << (i & 63));
  }
  return volume;
}

/// Where the hand means to be.
Vec3 meantAt(const HapticCase& c, double t) {
  if (!c.spinning) return {0, 0, std::min(kApproach.start_mm + 10 * t, kWallPull_mm)};
  return haptics::meantAt(c.holding, kApproach, t);
}

haptics::PortLimits limitsOf(const HapticCase& c) {
  haptics::PortLimits limits;
  if (c.guard) limits.most_brake_N_s_mm = 0.5 * haptics::gripOf(c.holding).mass_kg / 1000 * c.rate_hz;
  return limits;
}

/// Messages on their way: each comes when its time has come, in that order, which need not be the order of sending.
template <class Message>
class Line {
 public:
  Line(const HapticCase& c, std::uint64_t salt) : case_(c), random_(mix64(c.seed * 2 + salt)) {}

  void send(double now_s, const Message& message, std::uint64_t& lost) {
    const double late = random_.unit(), gone = random_.unit();
    if (gone < case_.loss) {
      ++lost;
      return;
    }
    const double due_s = now_s + 1e-3 * (0.5 * case_.delay_ms + late * case_.jitter_ms);
    const auto after = std::upper_bound(queue_.begin(), queue_.end(), due_s,
                                        [](double due, const auto& item) { return due < item.first; });
    queue_.insert(after, {due_s, message});
  }
  std::optional<Message> take(double now_s) {
    if (queue_.empty() || queue_.front().first > now_s) return {};
    const Message message = queue_.front().second;
    queue_.pop_front();
    return message;
  }

 private:
  const HapticCase& case_;
  Random random_;
  std::deque<std::pair<double, Message>> queue_;
};

struct Pose {
  std::uint32_t seq;
  session::Input input;
};
struct Answer {
  std::uint32_t seq;
  Vec3 force_N;  ///< path frame
  haptics::LocalModel model;
};

/// One course through a case: with the network and the device's rate, or ideally.
class Loop {
 public:
  Loop(const HapticCase& c, session::Session session)
      : case_(c),
        session_(std::move(session)),
        hand_(gripOf(c.holding)),
        port_(c.coupling, {session_.config().speed_rpm, session_.config().bit.diameter_mm}, limitsOf(c)),
        there_(c, 1),
        back_(c, 2) {
    hand_.place({0, 0, kApproach.start_mm});
    port_.place({hand_.at_mm(), {0, 0, 1}});
  }

  /// Until the session has answered the hand waits in the air; then the course begins. Ticks of time that it took.
  std::size_t greet() {
    std::size_t ticks = 0;
    for (; !answered_ && ticks < kMostWait; ++ticks) exchange(static_cast<double>(ticks) * kTick_s);
    begun_s_ = static_cast<double>(ticks) * kTick_s;
    return ticks;
  }

  void tick(double now_s) {
    exchange(now_s);
    const Vec3 before = hand_.at_mm();
    hand_.step(meantAt(case_, now_s - begun_s_), {}, force_N_, kTick_s);
    given_mJ_ += dot(force_N_, hand_.at_mm() - before);
    most_given_mJ_ = std::max(most_given_mJ_, given_mJ_);
  }

  [[nodiscard]] const Vec3& force_N() const { return force_N_; }
  [[nodiscard]] const Vec3& at_mm() const { return hand_.at_mm(); }
  [[nodiscard]] double depth_mm() const { return depth_mm_; }
  [[nodiscard]] double mostGiven_mJ() const { return most_given_mJ_; }
  [[nodiscard]] std::uint64_t late() const { return late_; }
  [[nodiscard]] std::uint64_t lost() const { return lost_; }

 private:
  /// The session answers when a pose comes, whenever that is; the device looks for answers once a period.
  void exchange(double now_s) {
    server(now_s);
    if (now_s + 1e-9 >= next_s_) device(now_s);
  }

  void device(double now_s) {
    const double period_s = 1 / case_.rate_hz;
    next_s_ += period_s;
    session::Input input;
    input.t_us = static_cast<std::uint64_t>(std::llround(now_s * 1e6));
    input.tip_mm = hand_.at_mm();
    input.spinning = case_.spinning;
    there_.send(now_s, {++seq_, input}, lost_);
    const haptics::Rod rod{hand_.at_mm(), {0, 0, 1}};
    const haptics::Reaction felt = port_.move(seq_, rod, period_s, case_.spinning);
    server(now_s);
    while (const std::optional<Answer> answer = back_.take(now_s)) {
      if (answered_ && static_cast<std::int32_t>(answer->seq - answered_seq_) <= 0) continue;
      answered_ = true;
      answered_seq_ = answer->seq;
      last_N_ = answer->force_N;
      port_.learn(answer->seq, answer->model);
    }
    const Vec3 wanted = case_.extrapolate ? haptics::fromTool(port_.rod().axis, felt.force_N) : last_N_;
    force_N_ = port_.push(rod, wanted, {}, period_s).force_N;
  }

  void server(double now_s) {
    while (const std::optional<Pose> pose = there_.take(now_s)) {
      const session::Output output = session_.step(pose->input);
      if (output.status != session::Status::Ok) {
        ++late_;
        continue;
      }
      depth_mm_ = output.depth_mm;
      back_.send(now_s, {pose->seq, haptics::fromTool(output.bit.axis, output.force_N), told_.of(session_, output.bit)},
                 lost_);
    }
  }

  const HapticCase& case_;
  session::Session session_;
  session::ToldModel told_;
  haptics::Hand hand_;
  haptics::Port port_;
  Line<Pose> there_;
  Line<Answer> back_;
  Vec3 force_N_, last_N_;
  double next_s_ = 0, begun_s_ = 0, depth_mm_ = kApproach.start_mm, given_mJ_ = 0, most_given_mJ_ = 0;
  std::uint32_t seq_ = 0, answered_seq_ = 0;
  bool answered_ = false;
  std::uint64_t late_ = 0, lost_ = 0;
};

/// Peak to peak of what is left of a course when its mean over kSlow_s is taken out, in the last quarter.
double swingOf(const std::vector<double>& course) {
  const auto half = static_cast<std::size_t>(0.5 * kSlow_s / kTick_s);
  if (course.size() < 4 * half) return 0;
  std::vector<double> sums(course.size() + 1, 0);
  for (std::size_t i = 0; i < course.size(); ++i) sums[i + 1] = sums[i] + course[i];
  double least = 1e300, most = -1e300;
  for (std::size_t i = course.size() * 3 / 4; i + half < course.size(); ++i) {
    const double mean = (sums[i + half] - sums[i - half]) / static_cast<double>(2 * half);
    least = std::min(least, course[i] - mean), most = std::max(most, course[i] - mean);
  }
  return most > least ? most - least : 0;
}

Result<Loop> loopOf(const HapticCase& c) {
  auto volume = boneOf(c.bone);
  if (!volume) return tl::unexpected(volume.error());
  session::Config config{plan::Bit{3, 5, 40}};
  config.coupling = c.coupling;
  auto session = session::Session::create(std::move(*volume), config);
  if (!session) return tl::unexpected(session.error());
  return Loop(c, std::move(*session));
}

Course follow(Loop& loop, double seconds) {
  Course course;
  const auto ticks = static_cast<std::size_t>(seconds / kTick_s);
  const std::size_t waited = loop.greet();
  for (std::size_t i = 0; i < ticks; ++i) {
    loop.tick(static_cast<double>(waited + i) * kTick_s);
    course.at_mm.push_back(loop.at_mm().z);
    course.force_N.push_back(loop.force_N().z);
    course.depth_mm.push_back(loop.depth_mm());
  }
  return course;
}

/// The same hand at 20 kHz, without network, guard or extrapolation.
HapticCase idealOf(HapticCase c) {
  c.rate_hz = 1 / kTick_s;
  c.delay_ms = c.jitter_ms = c.loss = 0;
  c.extrapolate = c.guard = false;
  return c;
}

}  // namespace

std::string_view nameOf(Bone bone) {
  constexpr std::array<std::string_view, 3> kNames{"cortex", "cancellous", "through the wall"};
  return kNames[static_cast<std::size_t>(bone)];
}

haptics::Coupling couplingOf(Holding holding, double rate_hz) {
  haptics::Coupling coupling;
  coupling.stiffness_N_mm = haptics::boundedStiffness_N_mm(coupling.stiffness_N_mm, gripOf(holding).damping_N_s_mm,
                                                           1 / rate_hz, coupling.damping_N_s_mm);
  return coupling;
}

Result<Course> idealCourse(const HapticCase& haptic_case) {
  const HapticCase ideal_case = idealOf(haptic_case);
  auto loop = loopOf(ideal_case);
  if (!loop) return tl::unexpected(loop.error());
  return follow(*loop, haptic_case.seconds);
}

Result<HapticResult> runLoop(const HapticCase& haptic_case, const Course& reference, HapticTrace* trace) {
  auto loop = loopOf(haptic_case);
  if (!loop) return tl::unexpected(loop.error());
  const Course course = follow(*loop, haptic_case.seconds);
  HapticResult result;
  double square = 0, sum = 0;
  const std::size_t ticks = std::min(course.force_N.size(), reference.force_N.size());
  for (std::size_t i = 0; i < ticks; ++i) {
    const double apart = course.force_N[i] - reference.force_N[i];
    square += apart * apart, sum -= reference.force_N[i];
  }
  const auto count = static_cast<double>(std::max<std::size_t>(1, ticks));
  result.force_rms_N = std::sqrt(square / count);
  result.force_mean_N = sum / count;
  const auto deepest = [](const Course& c) { return *std::max_element(c.depth_mm.begin(), c.depth_mm.end()); };
  if (!course.depth_mm.empty()) {
    result.overshoot_mm = std::max(0.0, deepest(course) - deepest(reference));
    result.depth_mm = deepest(course);
  }
  result.swing_mm = swingOf(course.at_mm);
  result.given_mJ = loop->mostGiven_mJ();
  result.late = loop->late(), result.lost = loop->lost();
  if (trace != nullptr) {
    for (std::size_t i = 0; i < course.at_mm.size(); i += 20) {
      trace->t_s.push_back(static_cast<double>(i) * kTick_s);
      trace->depth_mm.push_back(course.depth_mm[i]);
      trace->force_N.push_back(-course.force_N[i]);
    }
  }
  return result;
}

Result<double> stiffestStable_N_mm(HapticCase haptic_case) {
  haptic_case.spinning = false;
  haptic_case.holding = Holding::Relaxed;
  haptic_case.bone = Bone::Cancellous;
  haptic_case.seconds = 1.5;
  const auto isStable = [&](double stiffness) -> Result<bool> {
    haptic_case.coupling = {stiffness, 0};
    auto loop = loopOf(haptic_case);
    if (!loop) return tl::unexpected(loop.error());
    const Course course = follow(*loop, haptic_case.seconds);
    return swingOf(course.at_mm) < 0.02;
  };
  // Upwards until one swings: a guard may bring to rest what is much too stiff, and not what is a little too stiff.
  constexpr double kMost = 200, kApart = 1.5;
  double low = 0, high = 0.05;
  for (;; low = high, high = std::min(kMost, kApart * high)) {
    const Result<bool> stable = isStable(high);
    if (!stable) return tl::unexpected(stable.error());
    if (*stable && high < kMost) continue;
    if (*stable || low == 0) return *stable ? high : 0.0;
    break;
  }
  while (high > 1.05 * low) {
    const double middle = std::sqrt(low * high);
    const Result<bool> stable = isStable(middle);
    if (!stable) return tl::unexpected(stable.error());
    (*stable ? low : high) = middle;
  }
  return low;
}

}  // namespace spinaltap::tradeoff
