// server/ws/drill_loop_parts.h - what a loop holds for each session and for each connection; of drill_loop*.cpp alone.
#pragma once
#include <memory>
#include <vector>

#include "server/ws/drill_loop.h"

namespace spinaltap::ws {

/// A session, as long as it is drilled or waits for its trainee.
struct DrillLoop::Seat {
  enum class Phase : std::uint8_t { Vacant, Opening, Live, Ending };
  std::string id;
  Ticket ticket;
  wire::Token token{};
  Phase phase = Phase::Vacant;
  std::shared_ptr<LiveDrill> live;
  Client* driver = nullptr;
  std::vector<Client*> watchers;
  Clock::time_point alone_since;  ///< while nobody drives

  wire::Poses batch;
  std::size_t at = 0;  ///< the next pose of it
  wire::Feedback feedback;
  std::size_t unanswered = 0;  ///< batches answered since the driver's answers were last handed to the system
  Clock::time_point arrived{};
  std::uint64_t arrived_t_us = 0;
  bool overloaded = false;

  [[nodiscard]] bool isBusy() const { return phase == Phase::Live && at < batch.poses.size(); }
};

struct DrillLoop::Client {
  enum class Kind : std::uint8_t { New, Driver, Watcher, Over };
  Client(int socket, std::span<const std::byte> already_read, Clock::time_point now)
      : connection(socket, already_read), heard(now), since(now) {}
  Connection connection;
  Kind kind = Kind::New;
  Seat* seat = nullptr;
  wire::Hello hello;
  Clock::time_point heard, since;  ///< since: of kind
  Clock::time_point backlog_since{};
  bool has_backlog = false;
  bool pinged = false;
  bool deaf = false;  ///< what it sends is no WebSocket any more
  bool gone = false, unread = false, held = false;
};

}  // namespace spinaltap::ws
