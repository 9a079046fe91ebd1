// core/rbf/simd_sums.h - the inner loops over pairs of points, for whichever vector width the machine has (internal).
#pragma once
#include <cstddef>

namespace spinaltap::rbf {

/// One array a coordinate.
template <class T>
struct PointArrays {
  const T* x = nullptr;
  const T* y = nullptr;
  const T* z = nullptr;
  std::size_t count = 0;
};

/// out[i] += sum_j w_j |t_i - s_j|, sources in their own order, so that a target's bits depend on its sources alone.
/// The square root is an estimate refined by its series: relative error below 3e-14 (double), 3e-7 (single).
/// @pre squared distances between 1e-28 and 1e37, or the points equal.
void addDistances(const PointArrays<double>& targets, const PointArrays<double>& sources, const double* weights,
                  double* out);
/// Single precision: rounds at about 6e-8 of sum |w_j| |t_i - s_j|; give coordinates relative to somewhere near.
void addDistances(const PointArrays<float>& targets, const PointArrays<float>& sources, const float* weights,
                  double* out);

/// Both ways at once, each distance used twice: out_a[i] += sum_j w_b[j] |a_i - b_j|, out_b[j] += sum_i w_a[i] |a_i -
/// b_j|.
/// @pre no point is in both.
void addDistancesBothWays(const PointArrays<double>& a, const double* weights_a, double* out_a,
                          const PointArrays<double>& b, const double* weights_b, double* out_b);

/// As addDistances, with the machine's own square root, correctly rounded: the oracle.
void addExactDistances(const PointArrays<double>& targets, const PointArrays<double>& sources, const double* weights,
                       double* out);

/// out_x[i] += sum_j w_j (t_i - s_j).x / |t_i - s_j|, and y and z alike; equal points add nothing.
void addDirections(const PointArrays<double>& targets, const PointArrays<double>& sources, const double* weights,
                   double* out_x, double* out_y, double* out_z);
void addDirections(const PointArrays<float>& targets, const PointArrays<float>& sources, const float* weights,
                   double* out_x, double* out_y, double* out_z);
void addExactDirections(const PointArrays<double>& targets, const PointArrays<double>& sources, const double* weights,
                        double* out_x, double* out_y, double* out_z);

}  // namespace spinaltap::rbf
