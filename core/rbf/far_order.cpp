#include "core/rbf/far_order.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdlib>

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

std::vector<std::uint16_t> turnedNodes(int p, std::size_t turn) {
  std::vector<std::uint16_t> out;
  for (int a = 0; a < p; ++a) {
    for (int b = 0; b < p; ++b) {
      for (int c = 0; c < p; ++c) {
        const std::array<int, 3> at{a, b, c};
        int index = 0;
        for (std::size_t n = 0; n < 3; ++n) {
          const int along = at[static_cast<std::size_t>(kAxes[turn / 8][n])];
          index = index * p + ((turn % 8 >> n & 1) != 0 ? p - 1 - along : along);
        }
        out.push_back(static_cast<std::uint16_t>(index));
      }
    }
  }
  return out;
}

double lengthOf(const std::array<int, 3>& offset) {
  return 2.0 * std::sqrt(offset[0] * offset[0] + offset[1] * offset[1] + offset[2] * offset[2]);
}

/// How far each node is in this direction.
std::vector<double> nodesAlong(const Chebyshev& c, const std::array<int, 3>& offset) {
  std::vector<double> out;
  const double length = lengthOf(offset) / 2;
  for (int i = 0; i < c.nodes(); ++i)
    for (int j = 0; j < c.nodes(); ++j)
      for (int k = 0; k < c.nodes(); ++k)
        out.push_back((offset[0] * c.root(i) + offset[1] * c.root(j) + offset[2] * c.root(k)) / length);
  return out;
}

/// What is left of the distances from the nodes of a source cube `offset` cubes away to those of the target cube: a
/// column of stored() values for each source node.
template <class T>
std::vector<T> restOf(const Chebyshev& c, const std::array<int, 3>& offset, const std::vector<double>& along) {
  const int p = c.nodes();
  std::vector<T> m(c.stored() * c.values(), 0);
  const auto square = [&](std::size_t axis, int source, int target) {
    const double d = 2.0 * offset[axis] + c.root(source) - c.root(target);
    return d * d;
  };
  const double length = lengthOf(offset);
  std::size_t source = 0;
  for (int s0 = 0; s0 < p; ++s0)
    for (int s1 = 0; s1 < p; ++s1)
      for (int s2 = 0; s2 < p; ++s2, ++source) {
        T* to = m.data() + source * c.stored();
        std::size_t target = 0;
        for (int t0 = 0; t0 < p; ++t0)
          for (int t1 = 0; t1 < p; ++t1)
            for (int t2 = 0; t2 < p; ++t2, ++target) {
              const double d = std::sqrt(square(0, s0, t0) + square(1, s1, t1) + square(2, s2, t2));
              *to++ = static_cast<T>(d - length - along[source] + along[target]);
            }
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
  constexpr std::array<double, Chebyshev::kMost + 1> kError{1,      1,    1,      2e-3, 4e-4, 3e-5,
                                                            4.4e-6, 7e-7, 1.1e-7, 1e-8, 7e-10};
  return kError[static_cast<std::size_t>(nodes)];
}

FarOrder::FarOrder(int nodes, bool single) : chebyshev_(nodes), single_precision_(single) {
  for (std::size_t turn = 0; turn < turns_.size(); ++turn) turns_[turn] = turnedNodes(nodes, turn);
}

void FarOrder::prepare(int kind) {
  const auto n = static_cast<std::size_t>(kind);
  if (!along_[n].empty()) return;
  along_[n] = nodesAlong(chebyshev_, kKinds[n]);
  if (single()) {
    single_[n] = restOf<float>(chebyshev_, kKinds[n], along_[n]);
  } else {
    double_[n] = restOf<double>(chebyshev_, kKinds[n], along_[n]);
  }
}

double FarOrder::distance(int kind) const { return lengthOf(kKinds[static_cast<std::size_t>(kind)]); }

void FarOrder::see(int kind, const float* x, std::size_t columns, float* y) const {
  const std::vector<float>& m = single_[static_cast<std::size_t>(kind)];
  assert(!m.empty());
  const std::size_t stored = chebyshev_.stored(), count = chebyshev_.values();
  multiply(m.data(), stored, count, x, count, columns, y, stored);
}

void FarOrder::see(int kind, const double* x, std::size_t columns, double* y) const {
  const std::vector<double>& m = double_[static_cast<std::size_t>(kind)];
  assert(!m.empty());
  const std::size_t stored = chebyshev_.stored(), count = chebyshev_.values();
  multiply(m.data(), stored, count, x, count, columns, y, stored);
}

}  // namespace spinaltap::rbf
