#include "core/rbf/simd_dense.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/parallel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/rbf/simd_dense.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

// A product of some rows of a matrix with some columns of another, as raw strides (the file is read once a target).
#ifndef SPINALTAP_RBF_SIMD_DENSE_ONCE
#define SPINALTAP_RBF_SIMD_DENSE_ONCE
namespace spinaltap::rbf {
template <class T>
struct Operands {
  const T* a;            ///< a[k * a_stride + row]
  std::size_t a_stride;  //
  const T* b;            ///< b[k * b_inner + column * b_outer]
  std::size_t b_inner, b_outer;
  std::size_t inner;  ///< how many k
};
}  // namespace spinaltap::rbf
#endif

HWY_BEFORE_NAMESPACE();
namespace spinaltap::rbf::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t kWidth = 48;  // of a tile: whole vectors three at a time, for 2 to 16 lanes
// Columns of one tile: three vectors times this many sums stay in registers.
constexpr int kTileColumns = HWY_TARGET == HWY_AVX3 ? 8 : 4;
constexpr int kTileVectors = 3;

/// Sums of kVectors x kColumns: acc[v][c] (+)= sum_k a(v, k) b(k, c).
template <class T, int kVectors, int kColumns>
struct Tile {
  using D = hn::ScalableTag<T>;
  using V = hn::Vec<D>;
  V acc[kVectors][kColumns];

  HWY_INLINE void clear() {
    const D d;
    for (int v = 0; v < kVectors; ++v)
      for (int c = 0; c < kColumns; ++c) acc[v][c] = hn::Zero(d);
  }
  HWY_INLINE void add(const Operands<T>& o) {
    const D d;
    const std::size_t lanes = hn::Lanes(d);
    const T* HWY_RESTRICT a = o.a;
    const T* HWY_RESTRICT b = o.b;
    for (std::size_t k = 0; k < o.inner; ++k, a += o.a_stride, b += o.b_inner) {
      V left[kVectors];
      for (int v = 0; v < kVectors; ++v) left[v] = hn::LoadU(d, a + static_cast<std::size_t>(v) * lanes);
      for (int c = 0; c < kColumns; ++c) {
        const V right = hn::Set(d, b[static_cast<std::size_t>(c) * o.b_outer]);
        for (int v = 0; v < kVectors; ++v) acc[v][c] = hn::MulAdd(left[v], right, acc[v][c]);
      }
    }
  }
};

template <int kVectors, int kColumns, class T>
void multiplyTile(const T* a, std::size_t rows, std::size_t inner, const T* x, std::size_t x_stride, T* y,
                  std::size_t y_stride) {
  Tile<T, kVectors, kColumns> tile;
  const hn::ScalableTag<T> d;
  tile.clear();
  tile.add({a, rows, x, 1, x_stride, inner});
  for (int c = 0; c < kColumns; ++c)
    for (int v = 0; v < kVectors; ++v)
      hn::StoreU(tile.acc[v][c], d,
                 y + static_cast<std::size_t>(c) * y_stride + static_cast<std::size_t>(v) * hn::Lanes(d));
}

/// Some rows, for all columns: these rows stay in the second cache.
template <int kVectors, class T>
void multiplyRows(const TaperedMatrix<T>& a, std::size_t row, const T* x, std::size_t x_stride, std::size_t columns,
                  T* y, std::size_t y_stride) {
  const T* const own = a.values + row;
  const std::size_t inner = a.lengths[row];
  std::size_t c = 0;
  for (; c + kTileColumns <= columns; c += kTileColumns)
    multiplyTile<kVectors, kTileColumns>(own, a.rows, inner, x + c * x_stride, x_stride, y + c * y_stride + row,
                                         y_stride);
  for (; c < columns; ++c)
    multiplyTile<kVectors, 1>(own, a.rows, inner, x + c * x_stride, x_stride, y + c * y_stride + row, y_stride);
}

template <class T>
void multiplyAll(const TaperedMatrix<T>& a, const T* x, std::size_t x_stride, std::size_t columns, T* y,
                 std::size_t y_stride) {
  const std::size_t lanes = hn::Lanes(hn::ScalableTag<T>());
  std::size_t row = 0;
  for (; row + kTileVectors * lanes <= a.rows; row += kTileVectors * lanes)
    multiplyRows<kTileVectors>(a, row, x, x_stride, columns, y, y_stride);
  if (row + 2 * lanes <= a.rows) {
    multiplyRows<2>(a, row, x, x_stride, columns, y, y_stride);
    row += 2 * lanes;
  }
  for (; row < a.rows; row += lanes) multiplyRows<1>(a, row, x, x_stride, columns, y, y_stride);
}
void multiplyDouble(const TaperedMatrix<double>& a, const double* x, std::size_t x_stride, std::size_t columns,
                    double* y, std::size_t y_stride) {
  multiplyAll(a, x, x_stride, columns, y, y_stride);
}
void multiplySingle(const TaperedMatrix<float>& a, const float* x, std::size_t x_stride, std::size_t columns, float* y,
                    std::size_t y_stride) {
  multiplyAll(a, x, x_stride, columns, y, y_stride);
}

/// Subtracts from rows of tile (row, column) the products of the tiles left of it and of its column's diagonal tile.
template <class T>
void updateTile(const T* row_tiles, const T* column_tiles, std::size_t before, T* own) {
  const hn::ScalableTag<T> d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t row = 0; row < kWidth; row += kTileVectors * lanes) {
    for (std::size_t c = 0; c < kWidth; c += kTileColumns) {
      Tile<T, kTileVectors, kTileColumns> sums;
      sums.clear();
      // The tiles of a row lie one behind the other: one product over all their columns.
      sums.add({row_tiles + row, kWidth, column_tiles + c, kWidth, 1, before * kWidth});
      for (int n = 0; n < kTileColumns; ++n) {
        T* const to = own + (c + static_cast<std::size_t>(n)) * kWidth + row;
        for (int v = 0; v < kTileVectors; ++v) {
          T* const at = to + static_cast<std::size_t>(v) * lanes;
          hn::StoreU(hn::Sub(hn::LoadU(d, at), sums.acc[v][n]), d, at);
        }
      }
    }
  }
}

/// The tile on the diagonal, in place; its upper half is left with whatever comes of it. False when a pivot is lost.
template <class T>
bool factorTile(T* own, T* inverse_pivots) {
  const hn::ScalableTag<T> d;
  const std::size_t lanes = hn::Lanes(d);
  T diagonal[kWidth];
  for (std::size_t c = 0; c < kWidth; ++c) diagonal[c] = own[c * kWidth + c];
  for (std::size_t c = 0; c < kWidth; ++c) {
    T* const column = own + c * kWidth;
    const T pivot = column[c];
    if (!(pivot > static_cast<T>(8) * std::numeric_limits<T>::epsilon() * diagonal[c])) return false;
    const T root = std::sqrt(pivot);
    inverse_pivots[c] = static_cast<T>(1) / root;
    for (std::size_t r = 0; r < c; ++r) column[r] = 0;
    column[c] = root;
    for (std::size_t r = c + 1; r < kWidth; ++r) column[r] *= inverse_pivots[c];
    for (std::size_t next = c + 1; next < kWidth; ++next) {
      T* const to = own + next * kWidth;
      const auto share = hn::Set(d, column[next]);
      for (std::size_t r = next / lanes * lanes; r < kWidth; r += lanes)
        hn::StoreU(hn::NegMulAdd(share, hn::LoadU(d, column + r), hn::LoadU(d, to + r)), d, to + r);
    }
  }
  return true;
}

/// A factored tile on the diagonal by its inverse: solves are products with that, without a chain of divisions.
template <class T>
void invertTile(const T* inverse_pivots, T* own) {
  const hn::ScalableTag<T> d;
  const std::size_t lanes = hn::Lanes(d);
  T inverse[kWidth * kWidth] = {};
  for (std::size_t k = 0; k < kWidth; ++k) {
    const T* const column = own + k * kWidth;
    inverse[k * kWidth + k] = 1;
    for (std::size_t c = 0; c <= k; ++c) {
      T* const to = inverse + c * kWidth;
      const T share = to[k] * inverse_pivots[k];
      for (std::size_t r = k / lanes * lanes; r < kWidth; r += lanes)
        hn::StoreU(hn::NegMulAdd(hn::Set(d, share), hn::LoadU(d, column + r), hn::LoadU(d, to + r)), d, to + r);
      to[k] = share;
    }
  }
  std::copy(inverse, inverse + kWidth * kWidth, own);
}

/// own(r, c) = 2 - |rows_r - columns_c|.
template <class T>
void fillTile(const PointArrays<T>& rows, const PointArrays<T>& columns, T* own) {
  const hn::ScalableTag<T> d;
  const auto two = hn::Set(d, T{2});
  for (std::size_t c = 0; c < kWidth; ++c) {
    const auto x = hn::Set(d, columns.x[c]), y = hn::Set(d, columns.y[c]), z = hn::Set(d, columns.z[c]);
    for (std::size_t r = 0; r < kWidth; r += hn::Lanes(d)) {
      const auto dx = hn::Sub(hn::LoadU(d, rows.x + r), x), dy = hn::Sub(hn::LoadU(d, rows.y + r), y),
                 dz = hn::Sub(hn::LoadU(d, rows.z + r), z);
      const auto square = hn::MulAdd(dx, dx, hn::MulAdd(dy, dy, hn::Mul(dz, dz)));
      hn::StoreU(hn::Sub(two, hn::Sqrt(square)), d, own + c * kWidth + r);
    }
  }
}

/// A tile below the diagonal: own <- own diagonal^-T.
template <class T>
void divideTile(const T* diagonal, const T* inverse_pivots, T* own) {
  const hn::ScalableTag<T> d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t row = 0; row < kWidth; row += lanes) {
    T* const strip = own + row;
    for (std::size_t c = 0; c < kWidth; ++c) {
      auto sum = hn::LoadU(d, strip + c * kWidth), other = hn::Zero(d);
      std::size_t k = 0;
      for (; k + 1 < c; k += 2) {
        sum = hn::NegMulAdd(hn::LoadU(d, strip + k * kWidth), hn::Set(d, diagonal[k * kWidth + c]), sum);
        other =
            hn::NegMulAdd(hn::LoadU(d, strip + (k + 1) * kWidth), hn::Set(d, diagonal[(k + 1) * kWidth + c]), other);
      }
      if (k < c) sum = hn::NegMulAdd(hn::LoadU(d, strip + k * kWidth), hn::Set(d, diagonal[k * kWidth + c]), sum);
      hn::StoreU(hn::Mul(hn::Add(sum, other), hn::Set(d, inverse_pivots[c])), d, strip + c * kWidth);
    }
  }
}

/// to -= tile * x, rows kept in registers.
template <class T>
void subtractProduct(const T* tile, const T* HWY_RESTRICT x, T* HWY_RESTRICT to) {
  const hn::ScalableTag<T> d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t row = 0; row < kWidth; row += kTileVectors * lanes) {
    Tile<T, kTileVectors, 1> sums;
    sums.clear();
    sums.add({tile + row, kWidth, x, 1, 0, kWidth});
    for (int v = 0; v < kTileVectors; ++v) {
      T* const at = to + row + static_cast<std::size_t>(v) * lanes;
      hn::StoreU(hn::Sub(hn::LoadU(d, at), sums.acc[v][0]), d, at);
    }
  }
}

/// to -= tile^T * x, four columns at a time.
template <class T>
void subtractTransposedProduct(const T* tile, const T* HWY_RESTRICT x, T* HWY_RESTRICT to) {
  const hn::ScalableTag<T> d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t c = 0; c < kWidth; c += 4) {
    const T* const column = tile + c * kWidth;
    auto s0 = hn::Zero(d), s1 = hn::Zero(d), s2 = hn::Zero(d), s3 = hn::Zero(d);
    for (std::size_t r = 0; r < kWidth; r += lanes) {
      const auto v = hn::LoadU(d, x + r);
      s0 = hn::MulAdd(hn::LoadU(d, column + r), v, s0);
      s1 = hn::MulAdd(hn::LoadU(d, column + kWidth + r), v, s1);
      s2 = hn::MulAdd(hn::LoadU(d, column + 2 * kWidth + r), v, s2);
      s3 = hn::MulAdd(hn::LoadU(d, column + 3 * kWidth + r), v, s3);
    }
    to[c] -= hn::GetLane(hn::SumOfLanes(d, s0)), to[c + 1] -= hn::GetLane(hn::SumOfLanes(d, s1));
    to[c + 2] -= hn::GetLane(hn::SumOfLanes(d, s2)), to[c + 3] -= hn::GetLane(hn::SumOfLanes(d, s3));
  }
}

/// own <- what `subtract` makes of 0 and -own.
template <class T, class Subtract>
void replaceBy(const Subtract& subtract, const T* tile, T* own) {
  T negative[kWidth];
  for (std::size_t r = 0; r < kWidth; ++r) negative[r] = -own[r], own[r] = 0;
  subtract(tile, negative, own);
}

template <class T>
void lowerSolve(const T* tiles, std::size_t count, T* x) {
  for (std::size_t row = 0; row < count; ++row) {
    T* const own = x + row * kWidth;
    for (std::size_t column = 0; column < row; ++column, tiles += kWidth * kWidth)
      subtractProduct(tiles, x + column * kWidth, own);
    replaceBy(subtractProduct<T>, tiles, own);
    tiles += kWidth * kWidth;
  }
}

template <class T>
void upperSolve(const T* tiles, std::size_t count, T* x) {
  for (std::size_t row = count; row-- > 0;) {
    const T* const row_tiles = tiles + row * (row + 1) / 2 * kWidth * kWidth;
    T* const own = x + row * kWidth;
    replaceBy(subtractTransposedProduct<T>, row_tiles + row * kWidth * kWidth, own);
    for (std::size_t column = 0; column < row; ++column)
      subtractTransposedProduct(row_tiles + column * kWidth * kWidth, own, x + column * kWidth);
  }
}

// Dispatch takes plain functions.
void updateDouble(const double* row, const double* column, std::size_t before, double* own) {
  updateTile(row, column, before, own);
}
void updateSingle(const float* row, const float* column, std::size_t before, float* own) {
  updateTile(row, column, before, own);
}
bool factorDouble(double* own, double* inverse_pivots) { return factorTile(own, inverse_pivots); }
bool factorSingle(float* own, float* inverse_pivots) { return factorTile(own, inverse_pivots); }
void divideDouble(const double* diagonal, const double* pivots, double* own) { divideTile(diagonal, pivots, own); }
void divideSingle(const float* diagonal, const float* pivots, float* own) { divideTile(diagonal, pivots, own); }
void invertDouble(const double* pivots, double* own) { invertTile(pivots, own); }
void invertSingle(const float* pivots, float* own) { invertTile(pivots, own); }
void fillDouble(const PointArrays<double>& rows, const PointArrays<double>& columns, double* own) {
  fillTile(rows, columns, own);
}
void fillSingle(const PointArrays<float>& rows, const PointArrays<float>& columns, float* own) {
  fillTile(rows, columns, own);
}
void lowerDouble(const double* tiles, std::size_t count, double* x) { lowerSolve(tiles, count, x); }
void lowerSingle(const float* tiles, std::size_t count, float* x) { lowerSolve(tiles, count, x); }
void upperDouble(const double* tiles, std::size_t count, double* x) { upperSolve(tiles, count, x); }
void upperSingle(const float* tiles, std::size_t count, float* x) { upperSolve(tiles, count, x); }

}  // namespace spinaltap::rbf::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spinaltap::rbf {
namespace {

HWY_EXPORT(multiplyDouble);
HWY_EXPORT(multiplySingle);
HWY_EXPORT(updateDouble);
HWY_EXPORT(updateSingle);
HWY_EXPORT(factorDouble);
HWY_EXPORT(factorSingle);
HWY_EXPORT(divideDouble);
HWY_EXPORT(divideSingle);
HWY_EXPORT(invertDouble);
HWY_EXPORT(invertSingle);
HWY_EXPORT(fillDouble);
HWY_EXPORT(fillSingle);
HWY_EXPORT(lowerDouble);
HWY_EXPORT(lowerSingle);
HWY_EXPORT(upperDouble);
HWY_EXPORT(upperSingle);

void updateTile(const double* row, const double* column, std::size_t before, double* own) {
  HWY_DYNAMIC_DISPATCH(updateDouble)(row, column, before, own);
}
void updateTile(const float* row, const float* column, std::size_t before, float* own) {
  HWY_DYNAMIC_DISPATCH(updateSingle)(row, column, before, own);
}
bool factorTile(double* own, double* inverse_pivots) { return HWY_DYNAMIC_DISPATCH(factorDouble)(own, inverse_pivots); }
bool factorTile(float* own, float* inverse_pivots) { return HWY_DYNAMIC_DISPATCH(factorSingle)(own, inverse_pivots); }
void divideTile(const double* diagonal, const double* pivots, double* own) {
  HWY_DYNAMIC_DISPATCH(divideDouble)(diagonal, pivots, own);
}
void divideTile(const float* diagonal, const float* pivots, float* own) {
  HWY_DYNAMIC_DISPATCH(divideSingle)(diagonal, pivots, own);
}
void invertTile(const double* pivots, double* own) { HWY_DYNAMIC_DISPATCH(invertDouble)(pivots, own); }
void invertTile(const float* pivots, float* own) { HWY_DYNAMIC_DISPATCH(invertSingle)(pivots, own); }
void fillTile(const PointArrays<double>& rows, const PointArrays<double>& columns, double* own) {
  HWY_DYNAMIC_DISPATCH(fillDouble)(rows, columns, own);
}
void fillTile(const PointArrays<float>& rows, const PointArrays<float>& columns, float* own) {
  HWY_DYNAMIC_DISPATCH(fillSingle)(rows, columns, own);
}

// A column of fewer tiles than this is not worth sharing among threads.
constexpr std::size_t kTilesWorthThreads = 16;

}  // namespace

void multiply(const TaperedMatrix<double>& a, const double* x, std::size_t x_stride, std::size_t columns, double* y,
              std::size_t y_stride) {
  HWY_DYNAMIC_DISPATCH(multiplyDouble)(a, x, x_stride, columns, y, y_stride);
}
void multiply(const TaperedMatrix<float>& a, const float* x, std::size_t x_stride, std::size_t columns, float* y,
              std::size_t y_stride) {
  HWY_DYNAMIC_DISPATCH(multiplySingle)(a, x, x_stride, columns, y, y_stride);
}

template <class T>
TiledCholesky<T>::TiledCholesky(std::size_t size)
    : size_(size), tiles_((size + kTile - 1) / kTile), values_(tiles_ * (tiles_ + 1) / 2 * kTile * kTile, T{0}) {
  for (std::size_t c = size; c < paddedSize(); ++c) at(c, c) = T{1};
}

template <class T>
void TiledCholesky<T>::fill(const PointArrays<T>& points, T diagonal) {
  const auto part = [&](std::size_t t) {
    return PointArrays<T>{points.x + t * kTile, points.y + t * kTile, points.z + t * kTile, kTile};
  };
  for (std::size_t r = 0; r < tiles_; ++r)
    for (std::size_t c = 0; c <= r; ++c) fillTile(part(r), part(c), tile(r, c));
  for (std::size_t r = 0; r < size_; ++r) at(r, r) = diagonal;
  for (std::size_t r = size_; r < paddedSize(); ++r)
    for (std::size_t c = 0; c <= r; ++c) at(r, c) = r == c ? T{1} : T{0};
}

template <class T>
bool TiledCholesky<T>::factor(unsigned threads) {
  T pivots[kTile];
  for (std::size_t c = 0; c < tiles_; ++c) {
    updateTile(tile(c, 0), tile(c, 0), c, tile(c, c));
    if (!factorTile(tile(c, c), pivots)) return false;
    const std::size_t below = tiles_ - c - 1;
    parallelBlocks(below, 4, below >= kTilesWorthThreads ? threads : 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = c + 1 + begin; r < c + 1 + end; ++r) {
        updateTile(tile(r, 0), tile(c, 0), c, tile(r, c));
        divideTile(tile(c, c), pivots, tile(r, c));
      }
    });
    invertTile(pivots, tile(c, c));
  }
  return true;
}

template <>
void TiledCholesky<double>::solveLower(double* x) const {
  HWY_DYNAMIC_DISPATCH(lowerDouble)(values_.data(), tiles_, x);
}
template <>
void TiledCholesky<float>::solveLower(float* x) const {
  HWY_DYNAMIC_DISPATCH(lowerSingle)(values_.data(), tiles_, x);
}
template <>
void TiledCholesky<double>::solveUpper(double* x) const {
  HWY_DYNAMIC_DISPATCH(upperDouble)(values_.data(), tiles_, x);
}
template <>
void TiledCholesky<float>::solveUpper(float* x) const {
  HWY_DYNAMIC_DISPATCH(upperSingle)(values_.data(), tiles_, x);
}

template class TiledCholesky<float>;
template class TiledCholesky<double>;

}  // namespace spinaltap::rbf
#endif
