#include "core/rbf/far_order.h"

#include <gtest/gtest.h>

#include "tests/core/rbf/sets.h"

namespace spinaltap::rbf {
namespace {

struct OnePoint {
  double x, y, z;
  explicit OnePoint(const Vec3& p) : x(p.x), y(p.y), z(p.z) {}
  [[nodiscard]] PointArrays<double> array() const { return {&x, &y, &z, 1}; }
};

/// The distance from y to x, told by the terms of cubes of half side 1: y in the cube at 0, x in the one `offset` cubes
/// before it.
template <class T>
double told(const FarOrder& order, const FarKind& kind, const Vec3& x, const Vec3& y) {
  const Chebyshev& c = order.chebyshev();
  const double middle[3] = {0, 0, 0}, one = 1;
  std::vector<double> at(c.values(), 0.0), terms(order.terms(), 0.0), back = terms, values(c.values(), 0.0);
  c.gather(OnePoint(y).array(), &one, middle, 1, at.data());
  c.weighTerms(at.data(), terms.data());
  std::vector<T> turned(order.terms()), seen(order.stored());
  const FarOrder::Turn& turn = order.turned(kind.turn);
  for (std::size_t n = 0; n < terms.size(); ++n) turned[turn.term[n]] = static_cast<T>(turn.sign[n] * terms[n]);
  order.see(kind.kind, turned.data(), 1, seen.data());
  for (std::size_t n = 0; n < terms.size(); ++n) back[n] = turn.sign[n] * static_cast<double>(seen[turn.term[n]]);
  const std::array<double, 3> direction = FarOrder::direction(kind.kind);
  back[0] += FarOrder::distance(kind.kind);  // the weights have the sum 1
  for (std::size_t n = 1; n < 4; ++n) {
    const double along = turn.sign[n] * direction[turn.term[n] - 1U];
    back[0] += along * terms[n], back[n] -= along;
  }
  c.fromTerms(back.data(), values.data());
  double out = 0;
  c.spread(values.data(), middle, 1, OnePoint(x).array(), &out);
  return out;
}

double rmsError(FarOrder& order, const std::array<int, 3>& offset, int count, std::uint64_t seed) {
  Random random(seed);
  const FarKind kind = farKindOf(offset);
  order.prepare(kind.kind);
  double squares = 0;
  for (int k = 0; k < count; ++k) {
    const Vec3 x = randomPoint(random, 1), y = randomPoint(random, 1);
    const double exact = norm(Vec3{2.0 * offset[0], 2.0 * offset[1], 2.0 * offset[2]} + y - x);
    const double error = (order.single() ? told<float>(order, kind, x, y) : told<double>(order, kind, x, y)) - exact;
    squares += error * error;
  }
  return std::sqrt(squares / count);
}

TEST(FarOrder, IsAsWrongAsItsTableSays) {
  for (int nodes = Chebyshev::kFewest; nodes <= Chebyshev::kMost; ++nodes) {
    FarOrder order(nodes, false);
    const double rms = rmsError(order, {2, 0, 0}, 100, 31);
    // A root mean square over 100 pairs whose errors differ by a factor of thirty.
    EXPECT_GT(rms, farError(nodes) / 3) << nodes;
    EXPECT_LT(rms, farError(nodes) * 3) << nodes;
  }
}

TEST(FarOrder, SeesEveryTurnOfEveryKindWithFewerNodesAsWellAsTheNearest) {
  // 7 nodes for the nearest kind, down to 5 for others: a quarter of what the nearest shows at corners.
  std::vector<FarOrder> orders;
  for (int nodes = 5; nodes <= 7; ++nodes) orders.emplace_back(nodes, nodes < 7);
  for (int a = -3; a <= 3; ++a)
    for (int b = -3; b <= 3; ++b)
      for (int c = -3; c <= 3; ++c) {
        if (std::max({std::abs(a), std::abs(b), std::abs(c)}) < 2) continue;
        const int nodes = nodesFor(farKindOf({a, b, c}).kind, 7);
        FarOrder& order = orders[static_cast<std::size_t>(nodes - 5)];
        EXPECT_LT(rmsError(order, {a, b, c}, 10, 32), 8 * farError(7)) << a << " " << b << " " << c;
      }
}

}  // namespace
}  // namespace spinaltap::rbf
