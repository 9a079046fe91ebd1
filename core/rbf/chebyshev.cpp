#include "core/rbf/chebyshev.h"

#include <cassert>
#include <cmath>

#include "core/rbf/simd_chebyshev.h"

namespace spinaltap::rbf {
namespace {

constexpr double kPi = 3.14159265358979323846;

std::size_t strideOf(int p) { return p <= 8 ? 8 : 16; }

CubeBasis cubeOf(int p, const std::vector<double>& basis, const double middle[3], double half) {
  return {p, strideOf(p), basis.data(), {middle[0], middle[1], middle[2]}, half};
}

/// out(a, ., .) = sum_b m(a, b) in(b, ., .), and the axes turned: (a, b, c) -> (b, c, a). Three times is all axes.
void applyAndTurn(const std::vector<double>& m, std::size_t rows, std::size_t columns, std::size_t rest,
                  const double* in, double* out) {
  double sums[Chebyshev::kMost * Chebyshev::kMost];
  for (std::size_t a = 0; a < rows; ++a) {
    for (std::size_t n = 0; n < rest; ++n) sums[n] = m[a * columns] * in[n];
    for (std::size_t b = 1; b < columns; ++b)
      for (std::size_t n = 0; n < rest; ++n) sums[n] += m[a * columns + b] * in[b * rest + n];
    for (std::size_t n = 0; n < rest; ++n) out[n * rows + a] = sums[n];
  }
}

/// One matrix an axis: from `from` to `to` nodes an axis, added to out.
void applyToAxes(const std::vector<double>* const matrices[3], std::size_t to, std::size_t from, const double* in,
                 double* out) {
  constexpr std::size_t kMost = Chebyshev::kMost, kRoom = kMost * kMost * kMost;
  double a[kRoom], b[kRoom];
  applyAndTurn(*matrices[0], to, from, from * from, in, a);
  applyAndTurn(*matrices[1], to, from, from * to, a, b);
  applyAndTurn(*matrices[2], to, from, to * to, b, a);
  for (std::size_t n = 0; n < to * to * to; ++n) out[n] += a[n];
}

}  // namespace

Chebyshev::Chebyshev(int nodes) : p_(nodes) {
  assert(nodes >= kFewest && nodes <= kMost);
  const std::size_t p = static_cast<std::size_t>(nodes), stride = strideOf(nodes);
  const double count = nodes;
  for (std::size_t a = 0; a < p; ++a) roots_.push_back(std::cos(kPi * (static_cast<double>(a) + 0.5) / count));
  // The Lagrange polynomial of node a is the Chebyshev sum whose coefficients are T_k(root a) * 2 / p (1 / p for k =
  // 0).
  basis_.assign(p * stride, 0.0);
  for (std::size_t k = 0; k < p; ++k) {
    for (std::size_t a = 0; a < p; ++a) {
      const double angle = kPi * (static_cast<double>(a) + 0.5) / count;
      basis_[k * stride + a] = (k == 0 ? 1.0 : 2.0) / count * std::cos(static_cast<double>(k) * angle);
    }
  }
}

void Chebyshev::gather(const PointArrays<double>& points, const double* weights, const double middle[3], double half,
                       double* values) const {
  const std::size_t p = static_cast<std::size_t>(p_), stride = strideOf(p_);
  std::vector<double> rows(p * p * stride, 0.0);
  gatherWeights(cubeOf(p_, basis_, middle, half), points, weights, rows.data());
  for (std::size_t r = 0; r < p * p; ++r)
    for (std::size_t c = 0; c < p; ++c) values[r * p + c] += rows[r * stride + c];
}

void Chebyshev::spread(const double* values, const double middle[3], double half, const PointArrays<double>& points,
                       double* out) const {
  spreadValues(cubeOf(p_, basis_, middle, half), values, points, out);
}

void Chebyshev::spreadGradient(const double* values, const double middle[3], double half,
                               const PointArrays<double>& points, double* x, double* y, double* z) const {
  spreadGradients(cubeOf(p_, basis_, middle, half), values, points, x, y, z);
}

Transfer::Transfer(const Chebyshev& coarse, const Chebyshev& fine, const std::array<Place, 2>& places)
    : coarse_(static_cast<std::size_t>(coarse.nodes())), fine_(static_cast<std::size_t>(fine.nodes())) {
  const std::size_t stride = strideOf(coarse.nodes());
  for (std::size_t side = 0; side < 2; ++side) {
    up_[side].assign(coarse_ * fine_, 0.0), down_[side].assign(coarse_ * fine_, 0.0);
    for (std::size_t b = 0; b < fine_; ++b) {
      const double t = places[side].middle + places[side].half * fine.root(static_cast<int>(b));
      double before = t, value = 1;  // T_-1 = T_1
      for (std::size_t k = 0; k < coarse_; ++k) {
        for (std::size_t a = 0; a < coarse_; ++a) up_[side][a * fine_ + b] += coarse.basis_[k * stride + a] * value;
        const double next = 2 * t * value - before;
        before = value, value = next;
      }
      for (std::size_t a = 0; a < coarse_; ++a) down_[side][b * coarse_ + a] = up_[side][a * fine_ + b];
    }
  }
}

Transfer Transfer::toOctants(const Chebyshev& parent, const Chebyshev& child) {
  return {parent, child, {Place{-0.5, 0.5}, Place{0.5, 0.5}}};
}

Transfer Transfer::within(const Chebyshev& coarse, const Chebyshev& fine) {
  return {coarse, fine, {Place{0, 1}, Place{0, 1}}};
}

void Transfer::toCoarse(int octant, const double* fine, double* coarse) const {
  const std::vector<double>* const m[3] = {&up_[octant & 1], &up_[octant >> 1 & 1], &up_[octant >> 2 & 1]};
  applyToAxes(m, coarse_, fine_, fine, coarse);
}

void Transfer::toFine(int octant, const double* coarse, double* fine) const {
  const std::vector<double>* const m[3] = {&down_[octant & 1], &down_[octant >> 1 & 1], &down_[octant >> 2 & 1]};
  applyToAxes(m, fine_, coarse_, coarse, fine);
}

}  // namespace spinaltap::rbf
