// tests/bench/grids.h - rivals of the drill engines: the same cylinder of bone as a Cartesian grid.
#pragma once
#include <cstdint>
#include <memory>
#include <string_view>

#include "core/drill/engine.h"

namespace spinaltap::bench {

class Grid {
 public:
  virtual ~Grid() = default;
  /// Removes what is inside the bit. @pre as drill::Engine::step.
  virtual drill::Removal step(const drill::BitPose& pose) = 0;
  [[nodiscard]] virtual std::size_t points() const = 0;
  [[nodiscard]] virtual std::size_t bytes() const = 0;
};

/// `bytes`: a byte a point, and every point in the box around the bit is tested each cycle: what most simulators do.
/// `rows`:  a bit a point, and each row of the grid is cleared between where it enters and leaves the bit, worked out
///          analytically: the simple strong rival. Both hold 16-bit densities and sum up what they remove.
[[nodiscard]] std::unique_ptr<Grid> makeGrid(std::string_view name, const point_volume::Lattice& lattice,
                                             const plan::Bit& bit, std::uint16_t density_mg_cm3);

}  // namespace spinaltap::bench
