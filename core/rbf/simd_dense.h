// core/rbf/simd_dense.h - dense products and Cholesky factors, for whichever vector width the machine has (internal).
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/rbf/simd_sums.h"

namespace spinaltap::rbf {

/// Column-major, `rows` long each; row r is zero from column lengths[r] on, and lengths do not increase.
/// @pre rows is a multiple of 16.
template <class T>
struct TaperedMatrix {
  const T* values;
  std::size_t rows;
  const std::uint32_t* lengths;
};

/// y(:, c) = A x(:, c), all column-major with these strides. A column's bits do not depend on the other columns.
void multiply(const TaperedMatrix<double>& a, const double* x, std::size_t x_stride, std::size_t columns, double* y,
              std::size_t y_stride);
void multiply(const TaperedMatrix<float>& a, const float* x, std::size_t x_stride, std::size_t columns, float* y,
              std::size_t y_stride);

/// L with L L^T = A for a symmetric positive definite matrix, in square tiles of 48: only those on and below the
/// diagonal are stored, each in one piece, so that a product of two tiles runs through memory in order. Left-looking: a
/// column of tiles is updated by all columns before it in one long product. Once factored, a tile on the diagonal is
/// kept by its inverse.
template <class T>
class TiledCholesky {
 public:
  static constexpr std::size_t kTile = 48;

  explicit TiledCholesky(std::size_t size);

  [[nodiscard]] std::size_t size() const { return size_; }
  /// What solves need room for: size() rounded up to whole tiles.
  [[nodiscard]] std::size_t paddedSize() const { return tiles_ * kTile; }
  /// A(row, column), to be filled before factor(). @pre row >= column.
  [[nodiscard]] T& at(std::size_t row, std::size_t column) {
    return tile(row / kTile, column / kTile)[column % kTile * kTile + row % kTile];
  }

  /// A(r, c) = 2 - |p_r - p_c|, and the diagonal. @pre the points' arrays are paddedSize() long.
  void fill(const PointArrays<T>& points, T diagonal);

  /// False when a pivot is lost in the rounding of A's own diagonal: not positive definite in T.
  [[nodiscard]] bool factor(unsigned threads = 1);

  /// x <- L^-1 x, and x <- L^-T x. #paddedSize, zeros beyond size().
  void solveLower(T* x) const;
  void solveUpper(T* x) const;

 private:
  /// Column-major; row >= column. Row r of tiles begins after the 1 + 2 + ... + r tiles of those above.
  [[nodiscard]] T* tile(std::size_t row, std::size_t column) {
    return values_.data() + (row * (row + 1) / 2 + column) * kTile * kTile;
  }

  std::size_t size_, tiles_;  ///< the padding is a unit matrix
  std::vector<T> values_;
};

}  // namespace spinaltap::rbf
