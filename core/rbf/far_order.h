// core/rbf/far_order.h - how the nodes of one cube see those of another cube of its size (internal).
// After: Fong and Darve, "The black-box fast multipole method", J. Comput. Phys. 228 (2009).
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/rbf/chebyshev.h"

namespace spinaltap::rbf {

/// Cubes that are two or three cubes apart along some axis lie in one of 16 ways, up to the 48 symmetries of the cube.
struct FarKind {
  static constexpr int kCount = 16, kTurns = 48;
  std::uint8_t kind, turn;
};

/// @pre offset is within +-3, and beyond +-1 along some axis.
[[nodiscard]] FarKind farKindOf(const std::array<int, 3>& offset);

/// How many nodes an axis tell a pair of this kind as well as `nodes` tell the nearest kind, (2, 0, 0).
[[nodiscard]] int nodesFor(int kind, int nodes);

/// The root mean square of the error of |x - y|, told by the nodes of two cubes of half side 1 that are two cubes
/// apart; corners see up to some thirty times as much. @pre Chebyshev::kFewest <= nodes <= kMost.
[[nodiscard]] double farError(int nodes);

/// The distances between the nodes of two cubes, for each kind that was asked for.
class FarOrder {
 public:
  explicit FarOrder(int nodes);

  /// Makes the kind's matrix.
  void prepare(int kind);

  [[nodiscard]] const Chebyshev& chebyshev() const { return chebyshev_; }
  /// Whether single precision is finer than this order: its matrices are kept in single then, else in double.
  [[nodiscard]] bool single() const { return chebyshev_.nodes() <= kLastSingle; }
  /// Node n of a cube is node turns(turn)[n] of the turned cube.
  [[nodiscard]] const std::vector<std::uint16_t>& turned(int turn) const {
    return turns_[static_cast<std::size_t>(turn)];
  }

  /// y(:, c) = D x(:, c) for cubes of half side 1: columns of values() weights, to columns of stored() sums.
  /// @pre the kind is prepared, and T is float if single(), else double.
  void see(int kind, const float* x, std::size_t columns, float* y) const;
  void see(int kind, const double* x, std::size_t columns, double* y) const;

 private:
  static constexpr int kLastSingle = 6;

  Chebyshev chebyshev_;
  std::array<std::vector<std::uint16_t>, FarKind::kTurns> turns_;
  std::array<std::vector<double>, FarKind::kCount> double_;
  std::array<std::vector<float>, FarKind::kCount> single_;
};

}  // namespace spinaltap::rbf
