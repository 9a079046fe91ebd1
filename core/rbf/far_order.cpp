#include "core/rbf/far_order.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <numeric>

#include "core/base/vec3.h"
#include "core/rbf/simd_dense.h"

namespace spinaltap::rbf {
namespace {

/// The kinds' offsets, each sorted downwards.
constexpr std::array<std::array<int, 3>, FarKind::kCount> kKinds{{{2, 0, 0},
                                                                  {2, 1, 0},
                                                                  {2, 1, 1},
                                                                  {2, 2, 0},
                                                                  {2, 2, 1},
                                                                  {2, 2, 2},
                                                                  {3, 0, 0},
                                                                  {3, 1, 0},
                                                                  {3, 1, 1},
                                                                  {3, 2, 0},
                                                                  {3, 2, 1},
                                                                  {3, 2, 2},
                                                                  {3, 3, 0},
                                                                  {3, 3, 1},
                                                                  {3, 3, 2},
                                                                  {3, 3, 3}}};
constexpr int kFirstFarther = 3, kFirstFarthest = 9;

int kindOf(int a, int b, int c) { return (a == 2 ? 0 : 6) + b * (b + 1) / 2 + c; }

constexpr std::array<std::array<int, 3>, 6> kAxes{{{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}}};

int squareOf(const Chebyshev::Term& t) { return t[0] * t[0] + t[1] * t[1] + t[2] * t[2]; }

FarOrder::Turn turnOf(const Chebyshev& c, std::size_t turn) {
  FarOrder::Turn out;
  std::vector<std::uint16_t> index(c.values(), 0);
  const auto place = [&](const Chebyshev::Term& t) {
    return static_cast<std::size_t>((t[0] * c.nodes() + t[1]) * c.nodes() + t[2]);
  };
  for (std::size_t n = 0; n < c.terms().size(); ++n) index[place(c.terms()[n])] = static_cast<std::uint16_t>(n);
  for (const Chebyshev::Term& t : c.terms()) {
    Chebyshev::Term to{};
    bool odd = false;
    for (std::size_t n = 0; n < 3; ++n) {
      to[n] = t[static_cast<std::size_t>(kAxes[turn / 8][n])];
      odd = odd != ((turn % 8 >> n & 1) != 0 && to[n] % 2 != 0);
    }
    out.term.push_back(index[place(to)]);
    out.sign.push_back(odd ? -1 : 1);
  }
  return out;
}

/// For each row of a matrix, how many columns lie in the ball with it.
std::vector<std::uint32_t> lengthsOf(const Chebyshev& c) {
  const int limit = c.nodes() * (c.nodes() + 2);
  std::vector<std::uint32_t> out(Chebyshev::padded(c.terms().size()), 0);
  for (std::size_t r = 0; r < c.terms().size(); ++r) {
    const auto within = [&](const Chebyshev::Term& t) { return squareOf(t) + squareOf(c.terms()[r]) < limit; };
    out[r] = static_cast<std::uint32_t>(std::count_if(c.terms().begin(), c.terms().end(), within));
  }
  return out;
}

double lengthOf(const std::array<int, 3>& offset) {
  return 2.0 * std::sqrt(offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2]);
}

/// What is left of the distances from the nodes of a source cube `offset` cubes away to one node of the target cube.
void restAt(const Chebyshev& c, const std::array<int, 3>& offset, const std::array<int, 3>& target, double* rest) {
  const double length = lengthOf(offset);
  double step[3][Chebyshev::kMost];
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (int s = 0; s < c.nodes(); ++s) step[axis][s] = c.root(s) - c.root(target[axis]);
  for (int a = 0; a < c.nodes(); ++a)
    for (int b = 0; b < c.nodes(); ++b)
      for (int d = 0; d < c.nodes(); ++d) {
        const double x = step[0][a], y = step[1][b], z = step[2][d];
        const Vec3 whole{2.0 * offset[0] + x, 2.0 * offset[1] + y, 2.0 * offset[2] + z};
        *rest++ = norm(whole) - length - 2 * (offset[0] * x + offset[1] * y + offset[2] * z) / length;
      }
}

/// Their coefficients: a column of stored terms of the target for each term of the source.
template <class T>
std::vector<T> restOf(const Chebyshev& c, const std::array<int, 3>& offset, const std::vector<std::uint32_t>& lengths) {
  const int p = c.nodes();
  const std::size_t terms = c.terms().size(), stored = lengths.size(), nodes = c.values();
  std::vector<double> rest(nodes), half(terms * nodes), found(terms);
  std::size_t target = 0;
  for (int i = 0; i < p; ++i)
    for (int j = 0; j < p; ++j)
      for (int k = 0; k < p; ++k, ++target) {
        restAt(c, offset, {i, j, k}, rest.data());
        std::fill(found.begin(), found.end(), 0.0);
        c.interpolate(rest.data(), found.data());
        for (std::size_t n = 0; n < terms; ++n) half[n * nodes + target] = found[n];
      }
  std::vector<T> m(stored * terms, 0);
  for (std::size_t n = 0; n < terms; ++n) {
    std::fill(found.begin(), found.end(), 0.0);
    c.interpolate(half.data() + n * nodes, found.data());
    for (std::size_t r = 0; r < terms && n < lengths[r]; ++r) m[n * stored + r] = static_cast<T>(found[r]);
  }
  return m;
}

}  // namespace

FarKind farKindOf(const std::array<int, 3>& offset) {
  const std::array<int, 3> size{std::abs(offset[0]), std::abs(offset[1]), std::abs(offset[2])};
  for (std::size_t order = 0; order < 6; ++order) {
    const auto axis = [&](std::size_t n) { return static_cast<std::size_t>(kAxes[order][n]); };
    if (size[axis(0)] < size[axis(1)] || size[axis(1)] < size[axis(2)]) continue;
    int signs = 0;
    for (std::size_t n = 0; n < 3; ++n) signs |= offset[axis(n)] < 0 ? 1 << n : 0;
    return {static_cast<std::uint8_t>(kindOf(size[axis(0)], size[axis(1)], size[axis(2)])),
            static_cast<std::uint8_t>(order * 8 + static_cast<std::size_t>(signs))};
  }
  return {0, 0};
}

int nodesFor(int kind, int nodes) {
  // Below five nodes, errors of all kinds are alike.
  constexpr int kFewest = 5;
  const int fewer = (kind >= kFirstFarther ? 1 : 0) + (kind >= kFirstFarthest ? 1 : 0);
  return std::max(std::min(nodes, kFewest), nodes - fewer);
}

double farError(int nodes) {
  constexpr std::array<double, Chebyshev::kMost + 1> kError{1,      1,      1,      2.2e-3, 3.9e-4, 3.7e-5,
                                                            4.8e-6, 7.7e-7, 1.1e-7, 1.8e-8, 3.4e-9};
  return kError[static_cast<std::size_t>(nodes)];
}

FarOrder::FarOrder(int nodes, bool single)
    : chebyshev_(nodes), single_precision_(single), lengths_(lengthsOf(chebyshev_)) {
  for (std::size_t turn = 0; turn < turns_.size(); ++turn) turns_[turn] = turnOf(chebyshev_, turn);
}

void FarOrder::prepare(int kind) {
  const auto n = static_cast<std::size_t>(kind);
  if (!single_[n].empty() || !double_[n].empty()) return;
  if (single()) {
    single_[n] = restOf<float>(chebyshev_, kKinds[n], lengths_);
  } else {
    double_[n] = restOf<double>(chebyshev_, kKinds[n], lengths_);
  }
}

std::size_t FarOrder::products() const { return std::accumulate(lengths_.begin(), lengths_.end(), std::size_t{0}); }

double FarOrder::distance(int kind) { return lengthOf(kKinds[static_cast<std::size_t>(kind)]); }

std::array<double, 3> FarOrder::direction(int kind) {
  const std::array<int, 3>& offset = kKinds[static_cast<std::size_t>(kind)];
  const double length = lengthOf(offset);
  return {2 * offset[2] / length, 2 * offset[1] / length, 2 * offset[0] / length};
}

void FarOrder::see(int kind, const float* x, std::size_t columns, float* y) const {
  const std::vector<float>& m = single_[static_cast<std::size_t>(kind)];
  assert(!m.empty());
  multiply({m.data(), stored(), lengths_.data()}, x, terms(), columns, y, stored());
}

void FarOrder::see(int kind, const double* x, std::size_t columns, double* y) const {
  const std::vector<double>& m = double_[static_cast<std::size_t>(kind)];
  assert(!m.empty());
  multiply({m.data(), stored(), lengths_.data()}, x, terms(), columns, y, stored());
}

}  // namespace spinaltap::rbf
