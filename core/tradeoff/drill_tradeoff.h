// core/tradeoff/drill_tradeoff.h - what drilling costs and how true it is, by spacing, precision and threads, on the
// machine that it runs on.
#pragma once
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/drill/engine.h"
#include "core/session/scenes.h"
#include "core/tradeoff/surface_tradeoff.h"
#include "core/tradeoff/swept_volume.h"

namespace spinaltap::tradeoff {

/// A drill whose tip begins at the upper face, z = 0, of bone without end, and what it truly sweeps there.
struct DrillScene {
  plan::Bit bit;
  std::vector<drill::BitPose> poses;  ///< one a cycle of 1 ms
  Reach reach;
  Swept swept;
  std::size_t steady = 0;  ///< from this pose on the cone is in, and a cycle sweeps about the same as the one before
};

/// A scripted scene over the first length_mm of its path, with the report's bit, and its swept volume.
/// @error InvalidArgument (not longer than the bit's cone by a millimetre, or not finite).
/// @cost  seconds: sweptVolume of a thousand poses a millimetre for `hand`.
[[nodiscard]] Result<DrillScene> drillScene(session::Scene scene, double length_mm, const SweptOptions& options = {});

/// The lattice of a scene: as wide as the report's (30 rings at 0.1 mm), or as the bit reaches. Its cells' upper face,
/// half a spacing above disc 0, is where the scene begins, at any spacing; their other ends are beyond the bit's reach.
/// So what the bit sweeps in the lattice's cells is the same at every spacing.
[[nodiscard]] point_volume::Lattice drillLattice(const DrillScene& scene, double spacing_mm);

/// Builds a path's point volume on this lattice and gives the seconds it took.
using TimeBuild = std::function<Result<double>(const point_volume::Lattice&, int threads)>;

struct DrillRunOptions {
  std::string engine = "clearance";
  std::vector<drill::Precision> precisions{drill::Precision::Double, drill::Precision::Single};
  std::vector<int> threads{1, 2};
  int repeats = 3;  ///< a cycle counts with its fastest run: the rest is the machine's doing
  Clock clock;      ///< seconds; without one, times are 0
  TimeBuild build;  ///< empty: build_s is 0
};

struct DrillMeasured {
  double spacing_mm = 0;
  drill::Precision precision = drill::Precision::Double;
  int threads = 1;
  std::uint64_t points = 0;
  std::size_t bytes = 0;  ///< of the volume and the engine
  double build_s = 0;
  double median_s = 0, p999_s = 0;  ///< of a cycle
  double met_p999_s = 0;            ///< of all cycles of all runs, as the machine let them be
  double removed_mm3 = 0;           ///< points removed, times what each stands for
  double removed_error = 0;         ///< against the swept volume, relative
  double cycle_error = 0;           ///< removed in a steady cycle, mean, against what it sweeps, relative
  double ripple = 0;                ///< standard deviation of removed minus swept in a steady cycle, over the mean
  double ripple_smoothed = 0;       ///< the same after a low-pass of kSmoothing_cycles, as the hand feels thrust
  std::uint64_t differing = 0;  ///< points alive here and not as the first row of this spacing has it, or there alone
  std::uint64_t removed = 0;
};

/// 20 ms at one cycle a millisecond.
inline constexpr double kSmoothing_cycles = 20;

/// One row a precision and thread count, in that order, at one spacing.
/// @error Limit (lattice), those of drill::makeEngine and of the build.
/// @cost  repeats times the scene's cycles a row; memory: two volumes and an engine.
[[nodiscard]] Result<std::vector<DrillMeasured>> measureDrill(const DrillScene& scene, double spacing_mm,
                                                              const DrillRunOptions& options);

struct Wanted {
  double rate_hz = 1000;
  double headroom = 4;  ///< a cycle may take this part of its time: the rest is for force, messages and other work
  [[nodiscard]] double budget_s() const { return 1 / (rate_hz * headroom); }
};

/// The finest spacing that holds: its p99.9 cycle stays within the budget. Of that spacing's rows that do, the one in
/// double before single, with fewer threads before more. None when none does.
[[nodiscard]] std::optional<std::size_t> recommended(std::span<const DrillMeasured> rows, const Wanted& wanted);

[[nodiscard]] std::string_view nameOf(drill::Precision precision);

}  // namespace spinaltap::tradeoff
