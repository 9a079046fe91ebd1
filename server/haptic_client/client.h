// server/haptic_client/client.h - a drill on a server, felt by a device: the loop of the device on one thread, the
// network on another. Start here; a device is device.h.
#pragma once
#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/haptic_client/network.h"
#include "server/haptic_client/rest.h"

namespace spinaltap::haptic_client {

/// Real: the device's rate by the clock of this machine. Lockstep: time stands still until each pose is answered, so
/// that the same hand gives the same drill on any machine and network, as fast as these allow; for simulated hands.
enum class Pace : std::uint8_t { Real, Lockstep };

struct ClientSetup {
  Address server;
  std::string case_id, path_id;
  Pace pace = Pace::Real;
  bool realtime = false;         ///< ask for SCHED_FIFO for both threads
  double let_go_after_s = 0.25;  ///< without answers; see device_loop.h
  std::chrono::milliseconds patience{10'000};
  std::chrono::milliseconds resume_for{60'000};
  // Both are called on the device loop's thread (the last answers: on that of finish()), and may be empty.
  std::function<bool(const Tick&, double depth_mm)> on_tick = {};  ///< false ends the drill
  std::function<void(const Answered&)> on_answer = {};
};

/// Counts of the whole drill.
struct Tally {
  std::uint64_t ticks = 0, late_ticks = 0;     ///< late: a whole period and more, so that one was left out
  std::uint64_t limited = 0;                   ///< ticks at which the force was shortened to the device's maximum
  std::uint64_t braked = 0;                    ///< ticks at which the guard braked
  std::uint32_t sent = 0;                      ///< poses
  std::uint32_t resumed = 0;                   ///< how often the line broke and was taken up again
  std::uint64_t let_go = 0;                    ///< how often answers stayed away too long
  double peak_N = 0, sum_N_s = 0, felt_s = 0;  ///< the device's force; over the time that the drill was held
  double given_mJ = 0, most_given_mJ = 0;      ///< to the hand: at the end, and the most at any time
  double depth_mm = 0;                         ///< of the bit, as answered last
  Phase phase = Phase::Greeting;
};

struct Outcome {
  std::string recording_id, metrics_json;
  Tally tally;
  std::string device_error;  ///< empty unless the device ended the drill
};

class Client {
 public:
  /// Opens the device, makes a session on the server and starts both threads. @param device outlives the client.
  /// @error as the device says; Io, NotFound, Limit, Unsupported; InvalidArgument: traits out of range.
  [[nodiscard]] static Result<std::unique_ptr<Client>> start(const ClientSetup& setup, Device& device);
  /// Without finish(): the session stays paused on the server, which keeps it for a minute and its recording for good.
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  [[nodiscard]] const Site& site() const { return site_; }
  [[nodiscard]] const DeviceTraits& traits() const { return traits_; }
  [[nodiscard]] const wire::Welcome& welcome() const { return network_->welcome(); }
  /// As of the last tick or shortly before.
  [[nodiscard]] Tally tally() const;
  [[nodiscard]] bool isBroken() const { return network_->isBroken(); }
  /// True as long as the device's loop goes: until stop(), on_tick says so, the device fails or the server is gone.
  [[nodiscard]] bool isRunning() const { return running_.load(std::memory_order_acquire); }
  /// What was granted of real time; empty when it was not asked for.
  [[nodiscard]] const std::string& realtimeLine() const { return realtime_line_; }

  /// Ends the device's loop, motors off, and waits for it. More calls do nothing.
  void stop();
  /// stop(), then the server completes the recording. @error Io, Limit: the server is gone, or ended the drill.
  [[nodiscard]] Result<Outcome> finish();
  /// Microseconds, sorted. @pre finish() returned.
  [[nodiscard]] std::vector<std::uint32_t> roundTrips_us() const;

 private:
  using Clock = std::chrono::steady_clock;
  Client(const ClientSetup& setup, Device& device);
  [[nodiscard]] Result<void> connect();
  void run();
  void tickAtRate();
  void tickInStep();
  bool tickOnce(std::uint64_t t_us);
  void count(const Tick& tick, double seconds);

  ClientSetup setup_;
  Device& device_;
  DeviceTraits traits_;
  Site site_;
  bool opened_ = false;
  std::unique_ptr<Network> network_;
  std::unique_ptr<DeviceLoop> loop_;
  std::string realtime_line_;
  std::atomic<bool> stopping_ = false, running_ = false;
  mutable std::mutex mutex_;  ///< guards published_ and device_error_; the loop never waits for it
  Tally published_;
  std::string device_error_;
  Tally tally_;  ///< the loop's own
  std::uint64_t before_us_ = 0;
  std::thread thread_;
};

}  // namespace spinaltap::haptic_client
