#include "server/haptic_client/client.h"

#include <pthread.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "server/ws/realtime.h"

namespace spinaltap::haptic_client {
namespace {

Result<void> check(const DeviceTraits& traits) {
  const auto bad = [&](const char* what) {
    return fail(ErrorCode::InvalidArgument, "device '" + traits.name + "': its " + what + " is out of range");
  };
  if (!(traits.rate_hz >= kLeastRate_hz && traits.rate_hz <= kMostRate_hz)) return bad("rate (50 to 4000 Hz)");
  const auto known = [](double v) { return std::isfinite(v) && v >= 0; };
  if (!known(traits.max_force_N)) return bad("maximum force");
  if (!known(traits.max_stiffness_N_mm)) return bad("stiffness");
  if (!known(traits.damping_N_s_mm)) return bad("damping");
  if (!known(traits.mass_kg)) return bad("mass");
  return {};
}

}  // namespace

Client::Client(const ClientSetup& setup, Device& device) : setup_(setup), device_(device) {}

Result<std::unique_ptr<Client>> Client::start(const ClientSetup& setup, Device& device) {
  std::unique_ptr<Client> client(new Client(setup, device));
  auto site = findSite(setup.server, setup.case_id, setup.path_id, setup.patience);
  if (!site) return tl::unexpected(site.error());
  client->site_ = std::move(*site);
  auto traits = device.open();
  if (!traits) return tl::unexpected(traits.error());
  client->opened_ = true;
  client->traits_ = std::move(*traits);
  if (auto checked = check(client->traits_); !checked) return tl::unexpected(checked.error());
  if (auto connected = client->connect(); !connected) return tl::unexpected(connected.error());
  return client;
}

Result<void> Client::connect() {
  auto session = makeSession(setup_.server, setup_.case_id, setup_.path_id, setup_.patience);
  if (!session) return tl::unexpected(session.error());
  NetworkSetup how;
  how.server = setup_.server, how.session = *session, how.hello = helloFrom(traits_);
  how.patience = setup_.patience, how.resume_for = setup_.resume_for;
  auto network = Network::start(how);
  if (!network) return tl::unexpected(network.error());
  network_ = std::move(*network);
  LoopSetup loop = setupFrom(network_->welcome(), traits_, site_.diameter_mm);
  loop.let_go_after_s = setup_.let_go_after_s;
  loop_ = std::make_unique<DeviceLoop>(device_, *network_, loop, setup_.on_answer);
  running_ = true;
  thread_ = std::thread([this] { run(); });
  if (setup_.realtime) {
    bool granted = false;
    realtime_line_ = ws::askForFifo(std::array{thread_.native_handle(), network_->thread()}, granted);
  }
  return {};
}

Client::~Client() {
  stop();
  if (opened_ && !network_) device_.close();  // no loop ever ran
}

void Client::stop() {
  stopping_ = true;
  if (network_ && setup_.pace == Pace::Lockstep) network_->tell();
  if (thread_.joinable()) thread_.join();
}

Tally Client::tally() const {
  const std::lock_guard lock(mutex_);
  return published_;
}

void Client::run() {
  if (setup_.pace == Pace::Real) {
    tickAtRate();
  } else {
    tickInStep();
  }
  device_.close();
  {
    const std::lock_guard lock(mutex_);
    published_ = tally_;
  }
  running_ = false;
}

void Client::tickAtRate() {
  const auto period = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / traits_.rate_hz));
  const Clock::time_point begin = Clock::now();
  Clock::time_point due = begin;
  for (;;) {
    const auto since = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - begin);
    if (!tickOnce(static_cast<std::uint64_t>(since.count()) + 1)) return;
    if (traits_.paces_itself) continue;
    due += period;
    const auto late = (Clock::now() - due) / period;
    if (late > 0) due += late * period, tally_.late_ticks += static_cast<std::uint64_t>(late);
    std::this_thread::sleep_until(due);
  }
}

void Client::tickInStep() {
  const double period_us = 1e6 / traits_.rate_hz;
  for (std::uint64_t n = 1;; ++n) {
    const std::uint32_t resumed = network_->resumed(), sent = tally_.sent;
    if (!tickOnce(static_cast<std::uint64_t>(std::llround(static_cast<double>(n) * period_us)))) return;
    if (tally_.sent != sent) network_->waitForAnswer(tally_.sent - 1, resumed, stopping_);
  }
}

/// False when the drill is over.
bool Client::tickOnce(std::uint64_t t_us) {
  if (stopping_ || network_->hasEnded()) return false;
  const auto tick = loop_->tick(t_us);
  if (!tick) {
    const std::lock_guard lock(mutex_);
    device_error_ = tick.error().message;
    return false;
  }
  count(*tick, 1e-6 * static_cast<double>(t_us - before_us_));
  before_us_ = t_us;
  return !setup_.on_tick || setup_.on_tick(*tick, tally_.depth_mm);
}

void Client::count(const Tick& tick, double seconds) {
  ++tally_.ticks;
  tally_.sent = tick.sent, tally_.phase = tick.phase;
  tally_.limited += tick.felt.limited ? 1 : 0;
  const double force_N = norm(tick.felt.force_N);
  tally_.peak_N = std::max(tally_.peak_N, force_N);
  if (tick.phase == Phase::Holding) tally_.sum_N_s += force_N * seconds, tally_.felt_s += seconds;
  tally_.resumed = network_->resumed(), tally_.let_go = loop_->timesLetGo();
  tally_.given_mJ = loop_->guard().given_mJ(), tally_.most_given_mJ = loop_->guard().mostGiven_mJ();
  tally_.braked = loop_->guard().braked();
  tally_.depth_mm = loop_->depth_mm();
  if (const std::unique_lock lock(mutex_, std::try_to_lock); lock) published_ = tally_;
}

Result<Outcome> Client::finish() {
  stop();
  auto finished = network_->finish(setup_.resume_for + setup_.patience);
  if (!finished) return tl::unexpected(finished.error());
  loop_->listen();  // to the last answers, which came before that
  const std::lock_guard lock(mutex_);
  published_.depth_mm = loop_->depth_mm();
  return Outcome{finished->recording_id, finished->metrics_json, published_, device_error_};
}

std::vector<std::uint32_t> Client::roundTrips_us() const {
  std::vector<std::uint32_t> sorted = network_->roundTrips_us();
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

}  // namespace spinaltap::haptic_client
