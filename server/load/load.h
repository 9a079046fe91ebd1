// server/load/load.h - many trainees at once, over real sockets: what a server can bear, and how far that is from what
// the machine's sockets can.
#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "core/base/result.h"
#include "server/haptic_client/socket.h"
#include "server/jobs/figures.h"

namespace spinaltap::load {

/// A server that runs, and a path of one of its cases.
struct Target {
  haptic_client::Address server;
  std::string case_id, path_id;
};

struct LoadJob {
  int sessions = 64;
  double rate_hz = 1000;  ///< poses a second, one a message, of each session
  double seconds = 10;
  std::optional<Target> target;  ///< without one: a server of our own, on loopback, with a block of bone in it
  bool rigid = false;            ///< hold the bit without a coupling: less for the core to do
  bool realtime = false;         ///< of our own server, and of the generator
};

/// Drives scene `hand` in every session, evenly staggered; then an epoll echo of messages of the same sizes, for at
/// most ten seconds. Figures: see server/cli/README.md, `load`.
/// @error Io, NotFound, Limit; Corrupt when the server breaks the protocol.
[[nodiscard]] Result<jobs::Figures> run(const LoadJob& job, const jobs::Progress& progress);

}  // namespace spinaltap::load
