// wasm/session_binding.h - a live session as JavaScript sees it.
#pragma once
#include <emscripten/val.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/metrics/metrics.h"
#include "core/recording/recording.h"
#include "core/session/session.h"
#include "core/splats/splats.h"

namespace spinaltap::wasm {

struct StepResult {
  int status = 0;
  double cycle = 0, removed = 0, removed_total = 0, thrust_N = 0, depth_mm = 0;
  bool behind = false;
  Vec3 tip, axis;             ///< where the bit is, path frame
  Vec3 force_N, torque_Nmm;   ///< on the hand, in the bit's own frame
  Vec3 hand_force_N;          ///< the same force in the path frame
  double density_mg_cm3 = 0;  ///< mean of what this step removed; 0 when it removed nothing
};

class SessionBinding {
 public:
  struct Settings {
    recording::Header header;
    double length_mm = 0;
  };
  static Result<std::unique_ptr<SessionBinding>> create(point_volume::PointVolume volume, const Settings& settings);

  StepResult step(double t_us, double tx, double ty, double tz, double ax, double ay, double az, bool spinning);
  [[nodiscard]] std::string stateHash() const;
  [[nodiscard]] double points() const;
  [[nodiscard]] double pointsAlive() const;
  [[nodiscard]] emscripten::val aliveBits() const;
  emscripten::val takeSplats();
  [[nodiscard]] emscripten::val takeSplatIndices() const;
  emscripten::val takeHidden();
  [[nodiscard]] emscripten::val recordingBytes() const;
  [[nodiscard]] std::string metricsJson() const;

 private:
  SessionBinding(session::Session session, const Settings& settings);

  session::Session session_;
  recording::Header header_;
  std::vector<std::uint64_t> alive_before_;
  splats::SplatTracker tracker_;
  metrics::Accumulator metrics_;
  std::vector<session::Input> inputs_;
  struct State {
    std::uint64_t cycle, state_hash, removed_total;
  };
  std::vector<State> states_;               ///< after each input
  std::vector<std::uint32_t> removed_;      ///< by the last step
  std::vector<std::uint32_t> removed_all_;  ///< in order
  std::vector<std::uint32_t> taken_indices_;
};

void bindSession();
void bindHand();
void bindPlayer();

/// Bit (index & 31) of word (index >> 5), as a Uint32Array.
[[nodiscard]] emscripten::val aliveBitsOf(const point_volume::PointVolume& volume);

/// Seven floats a splat.
[[nodiscard]] emscripten::val floatsOf(const std::vector<splats::Splat>& splats);

}  // namespace spinaltap::wasm
