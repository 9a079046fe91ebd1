// core/rbf/chebyshev.h - functions on a cube by their values at p^3 Chebyshev nodes (internal).
// After: Fong and Darve, "The black-box fast multipole method", J. Comput. Phys. 228 (2009).
#pragma once
#include <cstddef>
#include <vector>

#include "core/rbf/simd_sums.h"

namespace spinaltap::rbf {

/// Node (a, b, c) of a cube lies at (root a, root b, root c) of the Chebyshev polynomial T_p, scaled to the cube, and
/// is entry (a p + b) p + c of its values.
class Chebyshev {
 public:
  static constexpr int kFewest = 3, kMost = 10;

  /// @pre kFewest <= nodes <= kMost.
  explicit Chebyshev(int nodes);

  [[nodiscard]] int nodes() const { return p_; }
  /// Length of a cube's values, and that rounded up to a multiple of 8, which is how they are stored.
  [[nodiscard]] std::size_t values() const { return static_cast<std::size_t>(p_) * p_ * p_; }
  [[nodiscard]] std::size_t stored() const { return (values() + 7) / 8 * 8; }
  [[nodiscard]] double root(int a) const { return roots_[static_cast<std::size_t>(a)]; }

  /// values[n] += sum_j w_j S_n(x_j): what the points weigh at the nodes.
  void gather(const PointArrays<double>& points, const double* weights, const double middle[3], double half,
              double* values) const;
  /// out[i] += the interpolant at the points; and its gradient.
  void spread(const double* values, const double middle[3], double half, const PointArrays<double>& points,
              double* out) const;
  void spreadGradient(const double* values, const double middle[3], double half, const PointArrays<double>& points,
                      double* out_x, double* out_y, double* out_z) const;

 private:
  int p_;
  std::vector<double> roots_;
  std::vector<double> basis_;  ///< S_a(x) = sum_k basis_[k * stride + a] T_k(x), stride 8 or 16, zeros beyond p
  friend class Transfer;
};

/// Between a cube and its children, which may have another number of nodes.
class Transfer {
 public:
  Transfer(const Chebyshev& parent, const Chebyshev& child);

  /// parent += what a child's weights are at the parent's nodes; the child is the octant (bits x, y, z).
  void toParent(int octant, const double* child, double* parent) const;
  /// child += the parent's interpolant at the child's nodes.
  void toChild(int octant, const double* parent, double* child) const;

 private:
  std::size_t parent_, child_;   ///< nodes an axis
  std::vector<double> up_[2];    ///< parent x child: S_a(root b seen from the parent), for the lower and upper half
  std::vector<double> down_[2];  ///< the same turned over
};

}  // namespace spinaltap::rbf
