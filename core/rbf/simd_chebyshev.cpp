#include "core/rbf/simd_chebyshev.h"

#include <algorithm>

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

/// T_0 .. T_{p-1} at t.
HWY_INLINE void polynomials(int p, double t, double* out) {
  out[0] = 1, out[1] = t;
  for (int k = 2; k < p; ++k) out[k] = 2 * t * out[k - 1] - out[k - 2];
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

void gatherAll(const CubeBasis& cube, const PointArrays<double>& points, const double* weights, double* values) {
  const D d;
  const std::size_t p = static_cast<std::size_t>(cube.nodes);
  HWY_ALIGN double s[3][kMostStride];
  for (std::size_t j = 0; j < points.count; ++j) {
    const double at[3] = {points.x[j], points.y[j], points.z[j]};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double polynomial[kMostNodes];
      polynomials(cube.nodes, (at[axis] - cube.middle[axis]) / cube.half, polynomial);
      combine(cube, polynomial, s[axis]);
    }
    for (std::size_t a = 0; a < p; ++a) {
      const double wa = weights[j] * s[0][a];
      for (std::size_t m = 0; m < p; ++m) {
        const auto share = hn::Set(d, wa * s[1][m]);
        double* const row = values + (a * p + m) * cube.stride;
        for (std::size_t n = 0; n < cube.stride; n += hn::Lanes(d))
          hn::StoreU(hn::MulAdd(share, hn::Load(d, s[2] + n), hn::LoadU(d, row + n)), d, row + n);
      }
    }
  }
}

using W = hn::ScalableTag<double>;
using V = hn::Vec<W>;

/// out(a, ., .) = sum_b m(a, b) in(b, ., .), and the axes turned: (a, b, c) -> (b, c, a). Three times is all axes.
/// @pre a vector's length more can be read behind `in`.
HWY_INLINE void applyAndTurn(const double* m, std::size_t rows, std::size_t columns, std::size_t rest, const double* in,
                             double* out) {
  const W d;
  HWY_ALIGN double lanes[HWY_MAX_BYTES / sizeof(double)];
  for (std::size_t n = 0; n < rest; n += hn::Lanes(d)) {
    V own[kMostNodes];
    for (std::size_t b = 0; b < columns; ++b) own[b] = hn::LoadU(d, in + b * rest + n);
    for (std::size_t a = 0; a < rows; ++a) {
      V sum = hn::Zero(d);
      for (std::size_t b = 0; b < columns; ++b) sum = hn::MulAdd(hn::Set(d, m[a * columns + b]), own[b], sum);
      hn::Store(sum, d, lanes);
      for (std::size_t k = 0; k < std::min(hn::Lanes(d), rest - n); ++k) out[(n + k) * rows + a] = lanes[k];
    }
  }
  std::fill(out + rows * rest, out + rows * rest + hn::Lanes(d), 0.0);
}

void applyAll(const double* const matrices[3], std::size_t to, std::size_t from, const double* values, double* out) {
  constexpr std::size_t kMost = 10, kRoom = kMost * kMost * kMost + HWY_MAX_BYTES / sizeof(double);
  double a[kRoom], b[kRoom];
  std::fill(std::copy(values, values + from * from * from, b), b + kRoom, 0.0);
  applyAndTurn(matrices[0], to, from, from * from, b, a);
  applyAndTurn(matrices[1], to, from, from * to, a, b);
  applyAndTurn(matrices[2], to, from, to * to, b, a);
  for (std::size_t n = 0; n < to * to * to; ++n) out[n] += a[n];
}

/// As many points as a vector has lanes, the last ones filled up with the last point: S_a along one axis, and its
/// slope.
struct AxisBasis {
  V s[kMostNodes], slope[kMostNodes];

  template <bool kSlopes>
  HWY_INLINE void set(const CubeBasis& cube, std::size_t axis, const double* coordinates, std::size_t count) {
    const W d;
    HWY_ALIGN double at[HWY_MAX_BYTES / sizeof(double)];
    for (std::size_t n = 0; n < hn::Lanes(d); ++n) at[n] = coordinates[std::min(n, count - 1)];
    const V t = hn::Mul(hn::Sub(hn::Load(d, at), hn::Set(d, cube.middle[axis])), hn::Set(d, 1 / cube.half));
    const V twice = hn::Add(t, t);
    V value[kMostNodes], change[kMostNodes];
    value[0] = hn::Set(d, 1.0), value[1] = t, change[0] = hn::Zero(d), change[1] = hn::Set(d, 1.0);
    for (int k = 2; k < cube.nodes; ++k) {
      value[k] = hn::MulSub(twice, value[k - 1], value[k - 2]);
      if (kSlopes)
        change[k] = hn::MulAdd(twice, change[k - 1], hn::MulSub(hn::Set(d, 2.0), value[k - 1], change[k - 2]));
    }
    for (int a = 0; a < cube.nodes; ++a) {
      const double* const basis = cube.basis + a;
      s[a] = slope[a] = hn::Zero(d);
      for (int k = 0; k < cube.nodes; ++k) {
        const V share = hn::Set(d, basis[static_cast<std::size_t>(k) * cube.stride]);
        s[a] = hn::MulAdd(share, value[k], s[a]);
        if (kSlopes) slope[a] = hn::MulAdd(share, change[k], slope[a]);
      }
    }
  }
};

/// Adds the lanes of the points there are.
HWY_INLINE void addLanes(V sums, std::size_t count, double* out) {
  const W d;
  HWY_ALIGN double lanes[HWY_MAX_BYTES / sizeof(double)];
  hn::Store(sums, d, lanes);
  for (std::size_t n = 0; n < std::min(count, hn::Lanes(d)); ++n) out[n] += lanes[n];
}

void spreadAll(const CubeBasis& cube, const double* values, const PointArrays<double>& points, double* out) {
  const W d;
  AxisBasis x, y, z;
  for (std::size_t i = 0; i < points.count; i += hn::Lanes(d)) {
    const std::size_t count = points.count - i;
    x.set<false>(cube, 0, points.x + i, count), y.set<false>(cube, 1, points.y + i, count);
    z.set<false>(cube, 2, points.z + i, count);
    V sum = hn::Zero(d);
    const double* value = values;
    for (int a = 0; a < cube.nodes; ++a) {
      V plane = hn::Zero(d);
      for (int b = 0; b < cube.nodes; ++b) {
        V row = hn::Zero(d);
        for (int c = 0; c < cube.nodes; ++c) row = hn::MulAdd(hn::Set(d, *value++), z.s[c], row);
        plane = hn::MulAdd(y.s[b], row, plane);
      }
      sum = hn::MulAdd(x.s[a], plane, sum);
    }
    addLanes(sum, count, out + i);
  }
}

void spreadSlopes(const CubeBasis& cube, const double* values, const PointArrays<double>& points, double* out_x,
                  double* out_y, double* out_z) {
  const W d;
  AxisBasis x, y, z;
  const V scale = hn::Set(d, 1 / cube.half);
  for (std::size_t i = 0; i < points.count; i += hn::Lanes(d)) {
    const std::size_t count = points.count - i;
    x.set<true>(cube, 0, points.x + i, count), y.set<true>(cube, 1, points.y + i, count);
    z.set<true>(cube, 2, points.z + i, count);
    V along_x = hn::Zero(d), along_y = hn::Zero(d), along_z = hn::Zero(d);
    const double* value = values;
    for (int a = 0; a < cube.nodes; ++a) {
      V plane = hn::Zero(d), plane_y = hn::Zero(d), plane_z = hn::Zero(d);
      for (int b = 0; b < cube.nodes; ++b) {
        V row = hn::Zero(d), row_z = hn::Zero(d);
        for (int c = 0; c < cube.nodes; ++c, ++value) {
          row = hn::MulAdd(hn::Set(d, *value), z.s[c], row);
          row_z = hn::MulAdd(hn::Set(d, *value), z.slope[c], row_z);
        }
        plane = hn::MulAdd(y.s[b], row, plane), plane_y = hn::MulAdd(y.slope[b], row, plane_y);
        plane_z = hn::MulAdd(y.s[b], row_z, plane_z);
      }
      along_x = hn::MulAdd(x.slope[a], plane, along_x), along_y = hn::MulAdd(x.s[a], plane_y, along_y);
      along_z = hn::MulAdd(x.s[a], plane_z, along_z);
    }
    addLanes(hn::Mul(along_x, scale), count, out_x + i), addLanes(hn::Mul(along_y, scale), count, out_y + i);
    addLanes(hn::Mul(along_z, scale), count, out_z + i);
  }
}

}  // namespace spinaltap::rbf::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spinaltap::rbf {

HWY_EXPORT(gatherAll);
HWY_EXPORT(spreadAll);
HWY_EXPORT(spreadSlopes);
HWY_EXPORT(applyAll);

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

void applyToAxes(const double* const matrices[3], std::size_t to, std::size_t from, const double* values, double* out) {
  HWY_DYNAMIC_DISPATCH(applyAll)(matrices, to, from, values, out);
}

}  // namespace spinaltap::rbf
#endif
