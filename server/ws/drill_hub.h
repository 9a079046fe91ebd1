// server/ws/drill_hub.h - all live drills of this server: which loop serves which.
#pragma once
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/ws/drill_loop.h"

namespace spinaltap::ws {

struct HubOptions {
  LoopOptions loop;
  std::size_t loops = 0;  ///< 0: as many as cores, at most 4; one that is idle costs nothing
  bool realtime = false;  ///< ask for SCHED_FIFO, locked memory and CPUs of their own
};

/// Safe from several threads.
class DrillHub {
 public:
  static constexpr std::size_t kMostLive = 64;

  /// @error Io.
  [[nodiscard]] static Result<std::unique_ptr<DrillHub>> start(store::Store& store, const HubOptions& options);
  DrillHub(const DrillHub&) = delete;
  DrillHub& operator=(const DrillHub&) = delete;
  ~DrillHub() { stop(); }

  [[nodiscard]] bool knows(const std::string& id) const;
  /// A session that begins; adopt() may follow. @error Limit.
  [[nodiscard]] Result<void> begin(const std::string& id, const Ticket& ticket);
  /// Gives a WebSocket, whose handshake is done, to its session; closes it when that is no more.
  void adopt(int socket, const std::string& id, std::vector<std::byte> already_read);

  [[nodiscard]] std::string metricsText() const;
  /// What was granted of real time; empty when it was not asked for.
  [[nodiscard]] const std::string& realtimeLine() const { return realtime_line_; }
  /// Says goodbye to everybody, and waits until every recording is kept.
  void stop();

 private:
  struct Place {
    Ticket ticket;
    std::size_t loop = 0;
    bool is_new = true;  ///< nobody has come yet
  };
  DrillHub() = default;

  mutable std::mutex mutex_;
  std::map<std::string, Place> places_;
  bool realtime_ = false;
  std::string realtime_line_;
  std::unique_ptr<TaskThread> tasks_ = std::make_unique<TaskThread>();
  std::vector<std::unique_ptr<DrillLoop>> loops_;
};

}  // namespace spinaltap::ws
