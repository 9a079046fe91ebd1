// core/rbf/far_order.h - how the nodes of one cube see those of another cube of its size (internal).
// After: Fong and Darve, "The black-box fast multipole method", J. Comput. Phys. 228 (2009).
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
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
/// The same of single precision.
inline constexpr double kFarSingleError = 4e-8;

/// How the terms of one cube's weights become those of another's values, for each kind that was asked for. A distance
/// is the cubes' own, plus how far the points are along the line between them, plus a small rest: only the rest, a
/// tenth as large, is in the matrices, so that single precision carries further. Of the rest's p^6 coefficients, those
/// outside a ball of six dimensions are less than its interpolant's own error: two fifths of them count for p = 5, a
/// quarter for 8.
class FarOrder {
 public:
  /// @param single whether the matrices are kept, and multiplied, in single precision.
  FarOrder(int nodes, bool single);

  /// Makes the kind's matrix.
  void prepare(int kind);

  [[nodiscard]] const Chebyshev& chebyshev() const { return chebyshev_; }
  [[nodiscard]] std::size_t terms() const { return chebyshev_.terms().size(); }
  [[nodiscard]] std::size_t stored() const { return Chebyshev::padded(terms()); }
  /// Products that one pair of cubes takes.
  [[nodiscard]] std::size_t products() const;
  /// How far apart two cubes of this kind are, both of half side 1, and how much farther with terms 1, 2, 3, which are
  /// z, y, x.
  [[nodiscard]] static double distance(int kind);
  [[nodiscard]] static std::array<double, 3> direction(int kind);
  [[nodiscard]] bool single() const { return single_precision_; }

  /// Term n of a cube is sign[n] times term[n] of the turned cube.
  struct Turn {
    std::vector<std::uint16_t> term;
    std::vector<double> sign;
  };
  [[nodiscard]] const Turn& turned(int turn) const { return turns_[static_cast<std::size_t>(turn)]; }

  /// y(:, c) = R x(:, c) for cubes of half side 1, R being |distance| - distance(kind) less the points' directions:
  /// columns of terms() weights, to columns of stored() coefficients.
  /// @pre the kind is prepared, and T is float if single(), else double.
  void see(int kind, const float* x, std::size_t columns, float* y) const;
  void see(int kind, const double* x, std::size_t columns, double* y) const;

 private:
  Chebyshev chebyshev_;
  bool single_precision_;
  std::vector<std::uint32_t> lengths_;  ///< of the matrices' rows
  std::array<Turn, FarKind::kTurns> turns_;
  std::array<std::vector<double>, FarKind::kCount> double_;
  std::array<std::vector<float>, FarKind::kCount> single_;
};

/// Orders that sums made one after the other can share. Not for two threads at once.
class FarOrders {
 public:
  [[nodiscard]] const std::shared_ptr<FarOrder>& get(int nodes, bool single) {
    std::shared_ptr<FarOrder>& order = made_[single ? 1 : 0][static_cast<std::size_t>(nodes)];
    if (order == nullptr) order = std::make_shared<FarOrder>(nodes, single);
    return order;
  }

 private:
  std::array<std::shared_ptr<FarOrder>, Chebyshev::kMost + 1> made_[2];
};

}  // namespace spinaltap::rbf
