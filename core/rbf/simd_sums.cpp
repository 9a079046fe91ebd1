#include "core/rbf/simd_sums.h"

#include <algorithm>
#include <cstdint>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/rbf/simd_sums.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spinaltap::rbf::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Where the machine estimates reciprocal roots, that and a series cost a third of a root.
constexpr bool kHasEstimate = HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3;

/// The root of a square, and its reciprocal, begun with an estimate.
struct Estimated {
  // Of what an estimate of twelve bits leaves, so many terms of the root's series leave less than a double's rounding;
  // of one of fourteen bits, one fewer.
  static constexpr int kTerms = HWY_TARGET == HWY_AVX3 ? 3 : 4;
  static constexpr double kTiny = 1e-30;

  /// A hair more than the square, so that the reciprocal is finite.
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V square(D d, V x, V y, V z) {
    const V tiny = hn::Set(d, static_cast<hn::TFromD<D>>(kTiny));
    return hn::MulAdd(x, x, hn::MulAdd(y, y, hn::MulAdd(z, z, tiny)));
  }
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V reciprocalEstimate(D d, V square) {
    if constexpr (sizeof(hn::TFromD<D>) == 4) {
      return hn::ApproximateReciprocalSqrt(square);
    } else {
#if HWY_TARGET == HWY_AVX3
      (void)d;
      return V{_mm512_rsqrt14_pd(square.raw)};
#else
      const hn::Rebind<float, D> df;
      return hn::PromoteTo(d, hn::ApproximateReciprocalSqrt(hn::DemoteTo(df, square)));
#endif
    }
  }
  /// v (1 - error)^(-1/2).
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V corrected(D d, V v, V error) {
    using T = hn::TFromD<D>;
    V series = hn::Set(d, static_cast<T>(0.5));
    if constexpr (sizeof(T) == 8) {
      constexpr double kSeries[] = {0.5, 3.0 / 8, 5.0 / 16, 35.0 / 128};
      series = hn::Set(d, kSeries[kTerms - 1]);
      for (int n = kTerms - 1; n-- > 0;) series = hn::MulAdd(series, error, hn::Set(d, kSeries[n]));
    }
    return hn::MulAdd(hn::Mul(v, error), series, v);
  }
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V root(D d, V square) {
    using T = hn::TFromD<D>;
    if constexpr (!kHasEstimate) {
      return hn::Sqrt(square);
    } else {
      const V q = reciprocalEstimate(d, square), root = hn::Mul(square, q);
      if constexpr (sizeof(T) == 8) {
        return corrected(d, root, hn::NegMulAdd(root, q, hn::Set(d, T{1})));
      } else {  // the product's own rounding is corrected, too
        return hn::MulAdd(hn::NegMulAdd(root, root, square), hn::Mul(q, hn::Set(d, T{0.5})), root);
      }
    }
  }
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V reciprocal(D d, V square) {
    using T = hn::TFromD<D>;
    if constexpr (!kHasEstimate) {
      return hn::Div(hn::Set(d, T{1}), hn::Sqrt(square));
    } else {
      const V q = reciprocalEstimate(d, square);
      return corrected(d, q, hn::NegMulAdd(hn::Mul(square, q), q, hn::Set(d, T{1})));
    }
  }
};

struct Exact {
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V square(D, V x, V y, V z) {
    return hn::MulAdd(x, x, hn::MulAdd(y, y, hn::Mul(z, z)));
  }
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V root(D, V square) {
    return hn::Sqrt(square);
  }
  template <class D, class V = hn::Vec<D>>
  static HWY_INLINE V reciprocal(D d, V square) {
    const V zero = hn::Zero(d), one = hn::Set(d, static_cast<hn::TFromD<D>>(1));
    return hn::IfThenZeroElse(hn::Eq(square, zero), hn::Div(one, hn::Sqrt(square)));
  }
};

/// Two vectors of targets, the last ones filled up with the last target: two chains hide the root's latency.
template <class T>
struct Chunk {
  static constexpr std::size_t kMost = 2 * std::size_t{HWY_MAX_BYTES} / sizeof(T);
  HWY_ALIGN T x[kMost];
  HWY_ALIGN T y[kMost];
  HWY_ALIGN T z[kMost];

  void load(const PointArrays<T>& p, std::size_t first, std::size_t lanes) {
    for (std::size_t n = 0; n < lanes; ++n) {
      const std::size_t i = std::min(first + n, p.count - 1);
      x[n] = p.x[i], y[n] = p.y[i], z[n] = p.z[i];
    }
  }
};

// Sums in single precision are handed over to double after so few sources: longer ones lose digits to their own size.
template <class T>
constexpr std::size_t kRun = sizeof(T) == 4 ? 8 : SIZE_MAX / 2;

/// What runs add up to, in double.
template <class T>
struct Total;

template <>
struct Total<double> {
  using D = hn::ScalableTag<double>;
  hn::Vec<D> sum;
  HWY_INLINE void clear() { sum = hn::Zero(D()); }
  HWY_INLINE void add(hn::Vec<D> run) { sum = hn::Add(sum, run); }
  HWY_INLINE void store(double* to) const { hn::StoreU(sum, D(), to); }
};

template <>
struct Total<float> {
  using D = hn::ScalableTag<float>;
  using Wide = hn::ScalableTag<double>;
  hn::Vec<Wide> lower, upper;
  HWY_INLINE void clear() { lower = upper = hn::Zero(Wide()); }
  HWY_INLINE void add(hn::Vec<D> run) {
#if HWY_TARGET == HWY_SCALAR
    lower = hn::Add(lower, hn::PromoteTo(Wide(), run));
#else
    const hn::Half<D> half;
    lower = hn::Add(lower, hn::PromoteTo(Wide(), hn::LowerHalf(half, run)));
    upper = hn::Add(upper, hn::PromoteTo(Wide(), hn::UpperHalf(half, run)));
#endif
  }
  HWY_INLINE void store(double* to) const {
    hn::StoreU(lower, Wide(), to);
    hn::StoreU(upper, Wide(), to + hn::Lanes(Wide()));
  }
};

template <class T>
constexpr std::size_t kChunk = 2 * std::size_t{HWY_MAX_BYTES} / sizeof(T);

template <class Root, class T>
void distances(const PointArrays<T>& targets, const PointArrays<T>& sources, const T* HWY_RESTRICT w, double* out) {
  const hn::ScalableTag<T> d;
  const std::size_t lanes = hn::Lanes(d);
  Chunk<T> c;
  HWY_ALIGN double sums[kChunk<T>];
  for (std::size_t first = 0; first < targets.count; first += 2 * lanes) {
    c.load(targets, first, 2 * lanes);
    const auto xa = hn::Load(d, c.x), ya = hn::Load(d, c.y), za = hn::Load(d, c.z);
    const auto xb = hn::Load(d, c.x + lanes), yb = hn::Load(d, c.y + lanes), zb = hn::Load(d, c.z + lanes);
    Total<T> total_a, total_b;
    total_a.clear(), total_b.clear();
    for (std::size_t j = 0; j < sources.count;) {
      auto sum_a = hn::Zero(d), sum_b = hn::Zero(d);
      for (const std::size_t end = std::min(j + kRun<T>, sources.count); j < end; ++j) {
        const auto sx = hn::Set(d, sources.x[j]), sy = hn::Set(d, sources.y[j]), sz = hn::Set(d, sources.z[j]);
        const auto weight = hn::Set(d, w[j]);
        const auto ax = hn::Sub(xa, sx), ay = hn::Sub(ya, sy), az = hn::Sub(za, sz);
        const auto bx = hn::Sub(xb, sx), by = hn::Sub(yb, sy), bz = hn::Sub(zb, sz);
        sum_a = hn::MulAdd(weight, Root::root(d, Root::square(d, ax, ay, az)), sum_a);
        sum_b = hn::MulAdd(weight, Root::root(d, Root::square(d, bx, by, bz)), sum_b);
      }
      total_a.add(sum_a), total_b.add(sum_b);
    }
    total_a.store(sums), total_b.store(sums + lanes);
    const std::size_t count = std::min(2 * lanes, targets.count - first);
    for (std::size_t n = 0; n < count; ++n) out[first + n] += sums[n];
  }
}

template <class Root, class T>
void directions(const PointArrays<T>& targets, const PointArrays<T>& sources, const T* HWY_RESTRICT w, double* out_x,
                double* out_y, double* out_z) {
  const hn::ScalableTag<T> d;
  const std::size_t lanes = hn::Lanes(d);
  Chunk<T> c;
  HWY_ALIGN double sums[3][kChunk<T> / 2];
  for (std::size_t first = 0; first < targets.count; first += lanes) {
    c.load(targets, first, lanes);
    const auto tx = hn::Load(d, c.x), ty = hn::Load(d, c.y), tz = hn::Load(d, c.z);
    Total<T> total_x, total_y, total_z;
    total_x.clear(), total_y.clear(), total_z.clear();
    for (std::size_t j = 0; j < sources.count;) {
      auto gx = hn::Zero(d), gy = hn::Zero(d), gz = hn::Zero(d);
      for (const std::size_t end = std::min(j + kRun<T>, sources.count); j < end; ++j) {
        const auto x = hn::Sub(tx, hn::Set(d, sources.x[j])), y = hn::Sub(ty, hn::Set(d, sources.y[j])),
                   z = hn::Sub(tz, hn::Set(d, sources.z[j]));
        const auto share = hn::Mul(hn::Set(d, w[j]), Root::reciprocal(d, Root::square(d, x, y, z)));
        gx = hn::MulAdd(share, x, gx), gy = hn::MulAdd(share, y, gy), gz = hn::MulAdd(share, z, gz);
      }
      total_x.add(gx), total_y.add(gy), total_z.add(gz);
    }
    total_x.store(sums[0]), total_y.store(sums[1]), total_z.store(sums[2]);
    const std::size_t count = std::min(lanes, targets.count - first);
    for (std::size_t n = 0; n < count; ++n) {
      out_x[first + n] += sums[0][n], out_y[first + n] += sums[1][n], out_z[first + n] += sums[2][n];
    }
  }
}

void distancesBothWays(const PointArrays<double>& a, const double* HWY_RESTRICT wa, double* out_a,
                       const PointArrays<double>& b, const double* HWY_RESTRICT wb, double* out_b) {
  const hn::ScalableTag<double> d;
  const std::size_t lanes = hn::Lanes(d);
  constexpr std::size_t kTile = 256;  // the other side's sums, a vector each, stay in the first cache
  Chunk<double> c;
  HWY_ALIGN double sums[Chunk<double>::kMost], weights[Chunk<double>::kMost];
  HWY_ALIGN double others[kTile * HWY_MAX_BYTES / sizeof(double)];
  for (std::size_t from = 0; from < b.count; from += kTile) {
    const std::size_t tile = std::min(kTile, b.count - from);
    for (std::size_t j = 0; j < tile; ++j) hn::Store(hn::Zero(d), d, others + j * lanes);
    for (std::size_t first = 0; first < a.count; first += 2 * lanes) {
      const std::size_t count = std::min(2 * lanes, a.count - first);
      c.load(a, first, 2 * lanes);
      for (std::size_t n = 0; n < 2 * lanes; ++n) weights[n] = n < count ? wa[first + n] : 0.0;
      const auto xa = hn::Load(d, c.x), ya = hn::Load(d, c.y), za = hn::Load(d, c.z);
      const auto xb = hn::Load(d, c.x + lanes), yb = hn::Load(d, c.y + lanes), zb = hn::Load(d, c.z + lanes);
      const auto own_a = hn::Load(d, weights), own_b = hn::Load(d, weights + lanes);
      auto sum_a = hn::Zero(d), sum_b = hn::Zero(d);
      for (std::size_t j = 0; j < tile; ++j) {
        const auto sx = hn::Set(d, b.x[from + j]), sy = hn::Set(d, b.y[from + j]), sz = hn::Set(d, b.z[from + j]);
        const auto weight = hn::Set(d, wb[from + j]);
        const auto ax = hn::Sub(xa, sx), ay = hn::Sub(ya, sy), az = hn::Sub(za, sz);
        const auto bx = hn::Sub(xb, sx), by = hn::Sub(yb, sy), bz = hn::Sub(zb, sz);
        const auto ra = Estimated::root(d, Estimated::square(d, ax, ay, az));
        const auto rb = Estimated::root(d, Estimated::square(d, bx, by, bz));
        sum_a = hn::MulAdd(weight, ra, sum_a);
        sum_b = hn::MulAdd(weight, rb, sum_b);
        double* const other = others + j * lanes;
        hn::Store(hn::MulAdd(own_a, ra, hn::MulAdd(own_b, rb, hn::Load(d, other))), d, other);
      }
      hn::Store(sum_a, d, sums);
      hn::Store(sum_b, d, sums + lanes);
      for (std::size_t n = 0; n < count; ++n) out_a[first + n] += sums[n];
    }
    for (std::size_t j = 0; j < tile; ++j) {
      double sum = 0;
      for (std::size_t n = 0; n < lanes; ++n) sum += others[j * lanes + n];
      out_b[from + j] += sum;
    }
  }
}

void distancesDouble(const PointArrays<double>& t, const PointArrays<double>& s, const double* w, double* out) {
  distances<Estimated>(t, s, w, out);
}
void distancesSingle(const PointArrays<float>& t, const PointArrays<float>& s, const float* w, double* out) {
  distances<Estimated>(t, s, w, out);
}
void distancesExact(const PointArrays<double>& t, const PointArrays<double>& s, const double* w, double* out) {
  distances<Exact>(t, s, w, out);
}
void directionsDouble(const PointArrays<double>& t, const PointArrays<double>& s, const double* w, double* x, double* y,
                      double* z) {
  directions<Estimated>(t, s, w, x, y, z);
}
void directionsSingle(const PointArrays<float>& t, const PointArrays<float>& s, const float* w, double* x, double* y,
                      double* z) {
  directions<Estimated>(t, s, w, x, y, z);
}
void directionsExact(const PointArrays<double>& t, const PointArrays<double>& s, const double* w, double* x, double* y,
                     double* z) {
  directions<Exact>(t, s, w, x, y, z);
}

}  // namespace spinaltap::rbf::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spinaltap::rbf {

HWY_EXPORT(distancesDouble);
HWY_EXPORT(distancesSingle);
HWY_EXPORT(distancesExact);
HWY_EXPORT(distancesBothWays);
HWY_EXPORT(directionsDouble);
HWY_EXPORT(directionsSingle);
HWY_EXPORT(directionsExact);

void addDistances(const PointArrays<double>& t, const PointArrays<double>& s, const double* w, double* out) {
  HWY_DYNAMIC_DISPATCH(distancesDouble)(t, s, w, out);
}
void addDistances(const PointArrays<float>& t, const PointArrays<float>& s, const float* w, double* out) {
  HWY_DYNAMIC_DISPATCH(distancesSingle)(t, s, w, out);
}
void addDistancesBothWays(const PointArrays<double>& a, const double* weights_a, double* out_a,
                          const PointArrays<double>& b, const double* weights_b, double* out_b) {
  HWY_DYNAMIC_DISPATCH(distancesBothWays)(a, weights_a, out_a, b, weights_b, out_b);
}
void addExactDistances(const PointArrays<double>& t, const PointArrays<double>& s, const double* w, double* out) {
  HWY_DYNAMIC_DISPATCH(distancesExact)(t, s, w, out);
}
void addDirections(const PointArrays<double>& t, const PointArrays<double>& s, const double* w, double* x, double* y,
                   double* z) {
  HWY_DYNAMIC_DISPATCH(directionsDouble)(t, s, w, x, y, z);
}
void addDirections(const PointArrays<float>& t, const PointArrays<float>& s, const float* w, double* x, double* y,
                   double* z) {
  HWY_DYNAMIC_DISPATCH(directionsSingle)(t, s, w, x, y, z);
}
void addExactDirections(const PointArrays<double>& t, const PointArrays<double>& s, const double* w, double* x,
                        double* y, double* z) {
  HWY_DYNAMIC_DISPATCH(directionsExact)(t, s, w, x, y, z);
}

}  // namespace spinaltap::rbf
#endif
