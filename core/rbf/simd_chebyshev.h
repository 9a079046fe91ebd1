// core/rbf/simd_chebyshev.h - the loops over points of chebyshev.h (internal).
#pragma once
#include <cstddef>

#include "core/rbf/simd_sums.h"

namespace spinaltap::rbf {

/// A cube and its interpolation.
struct CubeBasis {
  int nodes;
  std::size_t stride;   ///< of the basis, a multiple of 8
  const double* basis;  ///< p x stride, as Chebyshev::basis_
  double middle[3];
  double half;
};

/// values: p x p rows of stride, the multiple of 8 above p.
void gatherWeights(const CubeBasis& cube, const PointArrays<double>& points, const double* weights, double* values);
/// values: p x p x p.
void spreadValues(const CubeBasis& cube, const double* values, const PointArrays<double>& points, double* out);
void spreadGradients(const CubeBasis& cube, const double* values, const PointArrays<double>& points, double* out_x,
                     double* out_y, double* out_z);

/// out += values by one matrix an axis, from `from` to `to` nodes: matrices[n] is to x from, row by row. @pre at
/// most 10.
void applyToAxes(const double* const matrices[3], std::size_t to, std::size_t from, const double* values, double* out);

}  // namespace spinaltap::rbf
