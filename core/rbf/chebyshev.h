// core/rbf/chebyshev.h - functions on a cube by their values at p^3 Chebyshev nodes (internal).
// After: Fong and Darve, "The black-box fast multipole method", J. Comput. Phys. 228 (2009).
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
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
  /// Length of a cube's values, and that rounded up to a multiple of 16, which is how they are stored.
  [[nodiscard]] std::size_t values() const { return static_cast<std::size_t>(p_) * p_ * p_; }
  [[nodiscard]] std::size_t stored() const { return padded(values()); }
  [[nodiscard]] static std::size_t padded(std::size_t length) { return (length + 15) / 16 * 16; }
  [[nodiscard]] double root(int a) const { return roots_[static_cast<std::size_t>(a)]; }

  /// values[n] += sum_j w_j S_n(x_j): what the points weigh at the nodes.
  void gather(const PointArrays<double>& points, const double* weights, const double middle[3], double half,
              double* values) const;
  /// out[i] += the interpolant at the points; and its gradient.
  void spread(const double* values, const double middle[3], double half, const PointArrays<double>& points,
              double* out) const;
  void spreadGradient(const double* values, const double middle[3], double half, const PointArrays<double>& points,
                      double* out_x, double* out_y, double* out_z) const;

  /// Degrees of T_i T_j T_k with i^2 + j^2 + k^2 < p^2, ascending by that sum, so that fewer nodes' terms come first.
  /// What they leave out of all p^3 is less than the interpolant's own error. After: Trefethen, "Cubature,
  /// approximation, and isotropy in the hypercube", SIAM Review 59 (2017).
  using Term = std::array<std::uint8_t, 3>;
  [[nodiscard]] const std::vector<Term>& terms() const { return terms_; }
  /// terms[n] += sum of the nodes' weights times the n-th term there.
  void weighTerms(const double* weights, double* terms) const { addTerms(at_nodes_, weights, terms); }
  /// terms[n] += the interpolant's n-th coefficient.
  void interpolate(const double* values, double* terms) const { addTerms(interpolating_, values, terms); }
  /// values += the polynomial of these coefficients.
  void fromTerms(const double* terms, double* values) const;

 private:
  void listTerms();
  void addTerms(const std::vector<double>& matrix, const double* values, double* terms) const;

  int p_;
  std::vector<Term> terms_;
  std::vector<std::uint16_t> place_;                            ///< of each term among all p^3
  std::vector<double> at_nodes_, turned_over_, interpolating_;  ///< T_k(root a), its transpose, and S_a's coefficients
  std::vector<double> roots_;
  std::vector<double> basis_;  ///< S_a(x) = sum_k basis_[k * stride + a] T_k(x), stride 8 or 16, zeros beyond p
  friend class Transfer;
};

/// Between a cube's values and those of its octants, told by another number of nodes.
class Transfer {
 public:
  [[nodiscard]] static Transfer toOctants(const Chebyshev& parent, const Chebyshev& child);

  /// coarse += what the fine nodes' weights are at the coarse ones; fine is the octant (bits x, y, z).
  void toCoarse(int octant, const double* fine, double* coarse) const;
  /// fine += the coarse interpolant at the fine nodes.
  void toFine(int octant, const double* coarse, double* fine) const;

 private:
  struct Place {
    double middle, half;  ///< of the fine cube along an axis of the coarse one, which is -1 .. 1
  };
  Transfer(const Chebyshev& coarse, const Chebyshev& fine, const std::array<Place, 2>& places);

  std::size_t coarse_, fine_;    ///< nodes an axis
  std::vector<double> up_[2];    ///< coarse x fine: S_a(root b seen from the coarse cube), for each of the two places
  std::vector<double> down_[2];  ///< the same turned over
};

}  // namespace spinaltap::rbf
