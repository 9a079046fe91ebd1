// server/ws/drill_session.h - one live drill as its protocol sees it: a message in, an answer out.
// Contract: server/contract/haptics.md.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/store/store.h"
#include "server/ws/waiting_room.h"

namespace spinaltap::ws {

inline constexpr std::uint16_t kNormal = 1000, kGoingAway = 1001, kProtocolError = 1002, kPolicy = 1008,
                               kInternalError = 1011;
/// Ten hours at 1 kHz: no trainee drills longer, and a recording stays below 2.1 GB.
inline constexpr std::uint64_t kMostInputs = 36'000'000;

struct Answer {
  std::vector<std::byte> message;
  std::uint16_t close_code = 0;  ///< close after the message; 0 goes on
};
/// The refusal that the contract asks for, and the end of the connection.
[[nodiscard]] Answer refusal(const std::string& reason, std::uint16_t close_code);

/// Used by one thread. The recording is on disk as it grows; however the connection ends, what was drilled is kept.
class DrillSession {
 public:
  DrillSession(store::Store& store, Ticket ticket);
  DrillSession(const DrillSession&) = delete;
  DrillSession& operator=(const DrillSession&) = delete;
  ~DrillSession();  ///< keeps an unfinished recording

  /// Any bytes. After an answer with a close code nothing more is answered.
  [[nodiscard]] Answer onMessage(std::span<const std::byte> bytes);

  /// Keeps what was drilled, marked incomplete. Once is enough; again does nothing.
  void hangUp();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace spinaltap::ws
