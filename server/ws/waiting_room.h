// server/ws/waiting_room.h - drill sessions between POST /api/v1/sessions and their socket.
#pragma once
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "core/base/result.h"

namespace spinaltap::ws {

struct Ticket {
  std::string case_id, path_id;
};

/// Safe from several threads. An id cannot be guessed (125 random bits) and works once.
class WaitingRoom {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMostWaiting = 256;
  static constexpr std::chrono::seconds kPatience{60};

  /// @error Limit when too many wait.
  [[nodiscard]] Result<std::string> add(const Ticket& ticket, Clock::time_point now = Clock::now());
  /// Empty for an id that is unknown, used or too old.
  [[nodiscard]] std::optional<Ticket> take(const std::string& id, Clock::time_point now = Clock::now());

 private:
  struct Entry {
    Ticket ticket;
    Clock::time_point until;
  };
  std::mutex mutex_;
  std::map<std::string, Entry> waiting_;
};

}  // namespace spinaltap::ws
