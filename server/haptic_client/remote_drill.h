// server/haptic_client/remote_drill.h - a simulated hand drills on a server: `spinaltap drill --server`.
#pragma once
#include <filesystem>
#include <optional>

#include "server/haptic_client/client.h"
#include "server/haptic_client/virtual_device.h"
#include "server/jobs/figures.h"

namespace spinaltap::haptic_client {

struct RemoteDrill {
  Address server;
  std::string case_id, path_id;
  VirtualHand hand;
  std::optional<double> start_mm;  ///< of the tip past the entry point; default: where the modelled bone begins
  DeviceTraits device;             ///< what the hand holds
  Pace pace = Pace::Real;
  bool realtime = false;
  std::optional<double> depth_mm;  ///< until the bit's tip is there; default: the path's length
  std::optional<double> seconds;   ///< or so much time is over; default: three times what the feed needs, and 10 s
  /// CSV, whole or not at all; empty: none. A row an answer; columns as in jobs::DrillJob::forces, in the bone's
  /// newtons, then hand_x_mm, hand_y_mm, hand_z_mm, felt_x_N, felt_y_N, felt_z_N (what the device pushed, path frame),
  /// round_trip_us.
  std::filesystem::path forces;
};

/// Figures: server/cli/README.md, "drill, on a server".
/// @error as Client::start and Client::finish; Io: the file.
[[nodiscard]] Result<jobs::Figures> drillRemotely(const RemoteDrill& job, const jobs::Progress& progress);

}  // namespace spinaltap::haptic_client
