// server/haptic_client/rest.h - what a client asks a server over HTTP before it drills: the path, a session, a
// WebSocket.
#pragma once
#include <chrono>
#include <string>

#include "server/haptic_client/socket.h"

namespace spinaltap::haptic_client {

/// What there is to drill, as the server tells it.
struct Site {
  std::string case_id, path_id;
  double length_mm = 0;    ///< from entry to target
  double lead_mm = 0;      ///< how far before the entry the modelled bone begins
  double diameter_mm = 3;  ///< of the bit
};

// All block for at most `patience` a step. @error Io: no server, or it speaks otherwise; NotFound and Limit: in the
// server's own words.

[[nodiscard]] Result<Site> findSite(const Address& server, const std::string& case_id, const std::string& path_id,
                                    std::chrono::milliseconds patience);
/// The id of a new session. It waits a minute for its WebSocket.
[[nodiscard]] Result<std::string> makeSession(const Address& server, const std::string& case_id,
                                              const std::string& path_id, std::chrono::milliseconds patience);
/// A socket that speaks WebSocket from here on, of that session.
[[nodiscard]] Result<Socket> openWebSocket(const Address& server, const std::string& session,
                                           std::chrono::milliseconds patience);

}  // namespace spinaltap::haptic_client
