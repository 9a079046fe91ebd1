#include "server/load/load.h"

#include <pthread.h>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/session/scenes.h"
#include "server/haptic_client/rest.h"
#include "server/load/echo.h"
#include "server/load/own_server.h"
#include "server/ws/realtime.h"

namespace spinaltap::load {
namespace {
using Clock = std::chrono::steady_clock;
using haptic_client::Line;

constexpr double kMostEcho_s = 10;
constexpr double kGrace_s = 1;       // for the last answers
constexpr std::size_t kRing = 4096;  // poses under way that are told apart
constexpr std::chrono::seconds kPatience{30};

/// Of a feedback, without the cost of decoding it: this side must not be what is measured.
std::optional<std::uint32_t> seqOf(std::span<const std::byte> message) {
  const bool is_feedback =
      message.size() == wire::kFeedbackBytes && message[0] == static_cast<std::byte>(wire::MessageType::Feedback);
  if (!is_feedback) return {};
  return wire::ByteReader(message.subspan(2)).u32();
}

Result<Line> openLine(const Target& target, bool rigid) {
  const auto id = haptic_client::makeSession(target.server, target.case_id, target.path_id, kPatience);
  if (!id) return tl::unexpected(id.error());
  wire::Hello hello;
  hello.rigid = rigid;
  return Line::open(target.server, *id, hello, kPatience);
}

struct Measured {
  std::vector<std::uint32_t> round_trips_ns;
  std::uint64_t sent = 0, answered = 0, skipped = 0, late = 0, lost_lines = 0;
  double elapsed_s = 0;
};

/// One session's side of the clock.
struct Trainee {
  Line line;
  Clock::time_point due;
  std::uint32_t next = 0, answered = 0;  ///< the next to send; all before `answered` are answered
  std::array<Clock::time_point, kRing> sent_at{};
  bool ended = false;
};

class Driver {
 public:
  Driver(std::vector<Line> lines, double rate_hz, double seconds)
      : period_(std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / rate_hz))),
        seconds_(seconds),
        poll_(::epoll_create1(EPOLL_CLOEXEC)) {
    for (Line& line : lines)
      trainees_.push_back(std::make_unique<Trainee>(Trainee{std::move(line), {}, 0, 0, {}, false}));
    const double most = static_cast<double>(trainees_.size()) * rate_hz * seconds;
    measured_.round_trips_ns.reserve(static_cast<std::size_t>(std::min(most, 64e6)) + 1);
  }
  Driver(const Driver&) = delete;
  Driver& operator=(const Driver&) = delete;
  ~Driver() { ::close(poll_); }

  Measured run(const jobs::Progress& progress);

 private:
  void sendDue(Clock::time_point now);
  void send(Trainee& trainee, Clock::time_point now);
  void receive(Trainee& trainee);
  void wait(Clock::time_point until);
  [[nodiscard]] bool allAnswered() const;

  Clock::duration period_;
  double seconds_;
  int poll_;
  std::vector<std::unique_ptr<Trainee>> trainees_;
  std::size_t turn_ = 0;  ///< whose pose is due next: they are staggered evenly, so they take turns
  Measured measured_;
};

void Driver::send(Trainee& trainee, Clock::time_point now) {
  // a tick that is a whole period late was missed by us
  while (now - trainee.due > period_) {
    trainee.due += period_;
    ++measured_.skipped;
  }
  trainee.due += period_;
  if (trainee.ended) return;
  if (trainee.line.hasUnsent()) {  // the server does not read: what cannot be sent is missed
    ++measured_.skipped;
    trainee.ended = !trainee.line.flush();
    return;
  }
  trainee.sent_at[trainee.next % kRing] = now;
  const session::Input pose =
      session::sceneInput(session::Scene::Hand, std::min<std::uint64_t>(trainee.next, session::kMostSceneCycles));
  trainee.ended = !trainee.line.send(trainee.next, {&pose, 1});
  ++trainee.next;
  ++measured_.sent;
}

void Driver::sendDue(Clock::time_point now) {
  for (std::size_t n = 0; n < trainees_.size() && trainees_[turn_]->due <= now; ++n) {
    send(*trainees_[turn_], now);
    turn_ = (turn_ + 1) % trainees_.size();
  }
}

void Driver::receive(Trainee& trainee) {
  const bool alive = trainee.line.receive([&](std::span<const std::byte> message) {
    const auto answered = seqOf(message);
    if (!answered) return;
    const std::uint32_t seq = *answered;
    const Clock::time_point now = Clock::now();
    // a feedback that answers several is the answer of the last; the others never had one of their own
    if (seq >= trainee.next || trainee.next - seq > kRing) return;
    const Clock::duration took = now - trainee.sent_at[seq % kRing];
    const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(took).count();
    measured_.round_trips_ns.push_back(static_cast<std::uint32_t>(std::min<std::int64_t>(ns, UINT32_MAX)));
    ++measured_.answered;
    measured_.late += took > period_ ? 1 : 0;
    trainee.answered = seq + 1;
  });
  if (alive || trainee.ended) return;
  trainee.ended = true;
  ++measured_.lost_lines;
  ::epoll_ctl(poll_, EPOLL_CTL_DEL, trainee.line.handle(), nullptr);
}

void Driver::wait(Clock::time_point until) {
  std::array<epoll_event, 128> events{};
  const auto left = std::chrono::duration_cast<std::chrono::nanoseconds>(until - Clock::now()).count();
  timespec time{};
  if (left > 0) time.tv_sec = left / 1'000'000'000, time.tv_nsec = left % 1'000'000'000;
  const int count = ::epoll_pwait2(poll_, events.data(), static_cast<int>(events.size()), &time, nullptr);
  for (int i = 0; i < count; ++i) receive(*static_cast<Trainee*>(events[static_cast<std::size_t>(i)].data.ptr));
}

bool Driver::allAnswered() const {
  return std::all_of(trainees_.begin(), trainees_.end(),
                     [](const auto& trainee) { return trainee->ended || trainee->answered == trainee->next; });
}

Measured Driver::run(const jobs::Progress& progress) {
  const Clock::time_point start = Clock::now() + std::chrono::milliseconds(20);
  const Clock::time_point end =
      start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds_));
  for (std::size_t i = 0; i < trainees_.size(); ++i) {
    trainees_[i]->due = start + period_ * static_cast<int>(i) / static_cast<int>(trainees_.size());
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.ptr = trainees_[i].get();
    ::epoll_ctl(poll_, EPOLL_CTL_ADD, trainees_[i]->line.handle(), &event);
  }
  std::uint64_t turns = 0;
  for (Clock::time_point now = Clock::now(); now < end; now = Clock::now()) {
    sendDue(now);
    wait(std::min(end, trainees_[turn_]->due));
    if (progress && ++turns % 4096 == 0) {
      progress("load", std::clamp(std::chrono::duration<double>(now - start).count() / seconds_, 0.0, 1.0));
    }
  }
  for (const auto& trainee : trainees_) {  // due, and not sent in time
    for (; trainee->due < end; trainee->due += period_) ++measured_.skipped;
  }
  measured_.elapsed_s = std::chrono::duration<double>(Clock::now() - start).count();
  const Clock::time_point grace =
      end + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(kGrace_s));
  while (!allAnswered() && Clock::now() < grace) wait(std::min(grace, Clock::now() + std::chrono::milliseconds(10)));
  return std::move(measured_);
}

/// Of sorted round trips, microseconds. @param share 0 to 1.
double quantile_us(const std::vector<std::uint32_t>& sorted, double share) {
  if (sorted.empty()) return 0;
  const auto at = static_cast<std::size_t>(std::ceil(share * static_cast<double>(sorted.size())));
  return sorted[std::clamp<std::size_t>(at, 1, sorted.size()) - 1] * 1e-3;
}

jobs::Figures describe(Measured& measured) {
  std::sort(measured.round_trips_ns.begin(), measured.round_trips_ns.end());
  const auto& sorted = measured.round_trips_ns;
  return {{"sent", measured.sent},
          {"answered", measured.answered},
          {"unanswered", measured.sent - measured.answered},
          {"skipped", measured.skipped},
          {"missed", measured.skipped + (measured.sent - measured.answered)},
          {"late", measured.late},
          {"p50_us", quantile_us(sorted, 0.5)},
          {"p99_us", quantile_us(sorted, 0.99)},
          {"p999_us", quantile_us(sorted, 0.999)},
          {"max_us", quantile_us(sorted, 1)}};
}

double ownCpu_s() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

Result<jobs::Figures> drive(const LoadJob& job, const Target& target, const OwnServer* server,
                            const jobs::Progress& progress) {
  std::vector<Line> lines;
  for (int i = 0; i < job.sessions; ++i) {
    auto line = openLine(target, job.rigid);
    if (!line) return tl::unexpected(line.error());
    lines.push_back(std::move(*line));
  }
  const double server_before_s = server ? server->cpu_s() : 0, own_before_s = ownCpu_s();
  const long memory_before = server ? server->memory_KiB() : 0;
  Driver driver(std::move(lines), job.rate_hz, job.seconds);
  Measured measured = driver.run(progress);
  jobs::Figures figures = describe(measured);
  figures["generator_cpu"] = (ownCpu_s() - own_before_s) / measured.elapsed_s;
  if (server) {
    figures["server_cpu"] = (server->cpu_s() - server_before_s) / measured.elapsed_s;
    figures["server_memory_KiB"] = server->memory_KiB();
    figures["server_growth_KiB"] = server->memory_KiB() - memory_before;
  }
  if (measured.lost_lines > 0) {
    return fail(ErrorCode::Io, "load: the server ended " + std::to_string(measured.lost_lines) + " sessions");
  }
  return figures;
}

Result<jobs::Figures> echo(const LoadJob& job, const jobs::Progress& progress) {
  Echo server;
  std::vector<Line> lines;
  for (int i = 0; i < job.sessions; ++i) {
    auto line = server.connect();
    if (!line) return tl::unexpected(line.error());
    lines.push_back(std::move(*line));
  }
  const double before_s = ownCpu_s();
  Driver driver(std::move(lines), job.rate_hz, std::min(job.seconds, kMostEcho_s));
  Measured measured = driver.run(progress);
  jobs::Figures figures = describe(measured);
  figures["cpu"] = (ownCpu_s() - before_s) / measured.elapsed_s;  // of both ends
  return figures;
}

double ratio(const jobs::Figures& ours, const jobs::Figures& theirs, const char* key) {
  const double limit = theirs[key].get<double>();
  return limit > 0 ? ours[key].get<double>() / limit : 0;
}

}  // namespace

Result<jobs::Figures> run(const LoadJob& job, const jobs::Progress& progress) {
  std::unique_ptr<OwnServer> server;
  if (!job.target) {
    auto started = OwnServer::start(job.realtime);
    if (!started) return tl::unexpected(started.error());
    server = std::move(*started);
  }
  const pthread_t here = ::pthread_self();
  bool granted = false;  // of this side as well, or the generator's own waits would be measured
  const std::string line = job.realtime ? ws::askForFifo({&here, 1}, granted) : "";
  const auto driven = drive(job, job.target ? *job.target : server->target(), server.get(), progress);
  if (!driven) return tl::unexpected(driven.error());
  const std::string realtime = server ? server->realtimeLine() : "";
  server.reset();  // the echo has the machine to itself, as the drill had
  const auto echoed = echo(job, progress);
  if (!echoed) return tl::unexpected(echoed.error());
  jobs::Figures figures{
      {"sessions", job.sessions}, {"rate_hz", job.rate_hz}, {"seconds", job.seconds}, {"rigid", job.rigid}};
  if (!realtime.empty()) figures["realtime"] = realtime + "; generator: " + line;
  figures.update(*driven);
  for (const auto& [key, value] : echoed->items()) figures["echo_" + key] = value;
  for (const char* key : {"p50_us", "p99_us", "p999_us"}) {
    figures[std::string("ratio_") + std::string(key).substr(0, std::string(key).find('_'))] =
        ratio(*driven, *echoed, key);
  }
  return figures;
}

}  // namespace spinaltap::load
