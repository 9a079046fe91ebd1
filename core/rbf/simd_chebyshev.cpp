#include "core/rbf/simd_chebyshev.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/rbf/simd_chebyshev.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spinaltap::rbf::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<double, 8>;  // rows are padded to multiples of 8
constexpr std::size_t kMostStride = 16;
constexpr int kMostNodes = 16;

/// T_0 .. T_{p-1} at t, or their derivatives.
HWY_INLINE void polynomials(int p, double t, double* out) {
  out[0] = 1, out[1] = t;
  for (int k = 2; k < p; ++k) out[k] = 2 * t * out[k - 1] - out[k - 2];
}
HWY_INLINE void slopes(int p, double t, const double* values, double* out) {
  out[0] = 0, out[1] = 1;
  for (int k = 2; k < p; ++k) out[k] = 2 * values[k - 1] + 2 * t * out[k - 1] - out[k - 2];
}

/// S_a = sum_k basis(k, a) T_k.
HWY_INLINE void combine(const CubeBasis& cube, const double* polynomial, double* out) {
  const D d;
  for (std::size_t a = 0; a < cube.stride; a += hn::Lanes(d)) {
    auto sum = hn::Zero(d);
    for (int k = 0; k < cube.nodes; ++k)
      sum = hn::MulAdd(hn::LoadU(d, cube.basis + static_cast<std::size_t>(k) * cube.stride + a),
                       hn::Set(d, polynomial[k]), sum);
    hn::StoreU(sum, d, out + a);
  }
}

struct PointBasis {
  HWY_ALIGN double s[3][kMostStride];
  HWY_ALIGN double slope[3][kMostStride];
};

template <bool kSlopes>
HWY_INLINE void basisAt(const CubeBasis& cube, double x, double y, double z, PointBasis& out) {
  const double t[3] = {(x - cube.middle[0]) / cube.half, (y - cube.middle[1]) / cube.half,
                       (z - cube.middle[2]) / cube.half};
  for (int axis = 0; axis < 3; ++axis) {
    double polynomial[kMostNodes], slope[kMostNodes];
    polynomials(cube.nodes, t[axis], polynomial);
    combine(cube, polynomial, out.s[axis]);
    if constexpr (kSlopes) {
      slopes(cube.nodes, t[axis], polynomial, slope);
      combine(cube, slope, out.slope[axis]);
    }
  }
}

void gatherAll(const CubeBasis& cube, const PointArrays<double>& points, const double* weights, double* values) {
  const D d;
  const std::size_t p = static_cast<std::size_t>(cube.nodes);
  PointBasis b;
  for (std::size_t j = 0; j < points.count; ++j) {
    basisAt<false>(cube, points.x[j], points.y[j], points.z[j], b);
    for (std::size_t a = 0; a < p; ++a) {
      const double wa = weights[j] * b.s[0][a];
      for (std::size_t m = 0; m < p; ++m) {
        const auto share = hn::Set(d, wa * b.s[1][m]);
        double* const row = values + (a * p + m) * cube.stride;
        for (std::size_t n = 0; n < cube.stride; n += hn::Lanes(d))
          hn::StoreU(hn::MulAdd(share, hn::LoadU(d, b.s[2] + n), hn::LoadU(d, row + n)), d, row + n);
      }
    }
  }
}

/// sum over rows of x[a] y[m] row(a, m), dotted with z.
HWY_INLINE double contract(const CubeBasis& cube, const double* values, const double* x, const double* y,
                           const double* z) {
  const D d;
  const std::size_t p = static_cast<std::size_t>(cube.nodes);
  double total = 0;
  for (std::size_t n = 0; n < cube.stride; n += hn::Lanes(d)) {
    auto sum = hn::Zero(d);
    for (std::size_t a = 0; a < p; ++a) {
      auto part = hn::Zero(d);
      const double* const rows = values + a * p * cube.stride + n;
      for (std::size_t m = 0; m < p; ++m)
        part = hn::MulAdd(hn::Set(d, y[m]), hn::LoadU(d, rows + m * cube.stride), part);
      sum = hn::MulAdd(hn::Set(d, x[a]), part, sum);
    }
    total += hn::GetLane(hn::SumOfLanes(d, hn::Mul(sum, hn::LoadU(d, z + n))));
  }
  return total;
}

void spreadAll(const CubeBasis& cube, const double* values, const PointArrays<double>& points, double* out) {
  PointBasis b;
  for (std::size_t i = 0; i < points.count; ++i) {
    basisAt<false>(cube, points.x[i], points.y[i], points.z[i], b);
    out[i] += contract(cube, values, b.s[0], b.s[1], b.s[2]);
  }
}

void spreadSlopes(const CubeBasis& cube, const double* values, const PointArrays<double>& points, double* out_x,
                  double* out_y, double* out_z) {
  PointBasis b;
  for (std::size_t i = 0; i < points.count; ++i) {
    basisAt<true>(cube, points.x[i], points.y[i], points.z[i], b);
    out_x[i] += contract(cube, values, b.slope[0], b.s[1], b.s[2]) / cube.half;
    out_y[i] += contract(cube, values, b.s[0], b.slope[1], b.s[2]) / cube.half;
    out_z[i] += contract(cube, values, b.s[0], b.s[1], b.slope[2]) / cube.half;
  }
}

}  // namespace spinaltap::rbf::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spinaltap::rbf {

HWY_EXPORT(gatherAll);
HWY_EXPORT(spreadAll);
HWY_EXPORT(spreadSlopes);

void gatherWeights(const CubeBasis& cube, const PointArrays<double>& points, const double* weights, double* values) {
  HWY_DYNAMIC_DISPATCH(gatherAll)(cube, points, weights, values);
}
void spreadValues(const CubeBasis& cube, const double* values, const PointArrays<double>& points, double* out) {
  HWY_DYNAMIC_DISPATCH(spreadAll)(cube, values, points, out);
}
void spreadGradients(const CubeBasis& cube, const double* values, const PointArrays<double>& points, double* x,
                     double* y, double* z) {
  HWY_DYNAMIC_DISPATCH(spreadSlopes)(cube, values, points, x, y, z);
}

}  // namespace spinaltap::rbf
#endif
