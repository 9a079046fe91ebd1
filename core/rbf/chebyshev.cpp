#include "core/rbf/chebyshev.h"

#include <algorithm>
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
      const double value = std::cos(static_cast<double>(k) * angle);
      basis_[k * stride + a] = (k == 0 ? 1.0 : 2.0) / count * value;
      at_nodes_.push_back(value), interpolating_.push_back(basis_[k * stride + a]);
    }
  }
  turned_over_.resize(p * p);
  for (std::size_t k = 0; k < p; ++k)
    for (std::size_t a = 0; a < p; ++a) turned_over_[a * p + k] = at_nodes_[k * p + a];
  listTerms();
}

void Chebyshev::listTerms() {
  const auto square = [](const Term& t) { return t[0] * t[0] + t[1] * t[1] + t[2] * t[2]; };
  for (int i = 0; i < p_; ++i)
    for (int j = 0; j < p_; ++j)
      for (int k = 0; k < p_; ++k)
        if (i * i + j * j + k * k < p_ * p_)
          terms_.push_back({static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(j), static_cast<std::uint8_t>(k)});
  std::stable_sort(terms_.begin(), terms_.end(), [&](const Term& a, const Term& b) { return square(a) < square(b); });
  for (const Term& t : terms_) place_.push_back(static_cast<std::uint16_t>((t[0] * p_ + t[1]) * p_ + t[2]));
}

void Chebyshev::addTerms(const std::vector<double>& matrix, const double* values, double* terms) const {
  const double* const m[3] = {matrix.data(), matrix.data(), matrix.data()};
  const auto p = static_cast<std::size_t>(p_);
  double all[kMost * kMost * kMost] = {};
  applyToAxes(m, p, p, values, all);
  for (std::size_t n = 0; n < place_.size(); ++n) terms[n] += all[place_[n]];
}

void Chebyshev::fromTerms(const double* terms, double* values) const {
  const double* const m[3] = {turned_over_.data(), turned_over_.data(), turned_over_.data()};
  const auto p = static_cast<std::size_t>(p_);
  double all[kMost * kMost * kMost] = {};
  for (std::size_t n = 0; n < place_.size(); ++n) all[place_[n]] = terms[n];
  applyToAxes(m, p, p, all, values);
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

void Transfer::toCoarse(int octant, const double* fine, double* coarse) const {
  const double* const m[3] = {up_[octant & 1].data(), up_[octant >> 1 & 1].data(), up_[octant >> 2 & 1].data()};
  applyToAxes(m, coarse_, fine_, fine, coarse);
}

void Transfer::toFine(int octant, const double* coarse, double* fine) const {
  const double* const m[3] = {down_[octant & 1].data(), down_[octant >> 1 & 1].data(), down_[octant >> 2 & 1].data()};
  applyToAxes(m, fine_, coarse_, coarse, fine);
}

}  // namespace spinaltap::rbf
