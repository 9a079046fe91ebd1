#include "core/base/dmath.h"

#include <cmath>

namespace spinaltap {
namespace {

// Taylor series; on |x| <= pi/4 the first term left out is below 5e-17 for both.
double sinNear0(double x) {
  const double z = x * x;
  double p = -1.0 / 1307674368000.0;
  p = p * z + 1.0 / 6227020800.0;
  p = p * z - 1.0 / 39916800.0;
  p = p * z + 1.0 / 362880.0;
  p = p * z - 1.0 / 5040.0;
  p = p * z + 1.0 / 120.0;
  p = p * z - 1.0 / 6.0;
  return x + x * z * p;
}

double cosNear0(double x) {
  const double z = x * x;
  double p = 1.0 / 20922789888000.0;
  p = p * z - 1.0 / 87178291200.0;
  p = p * z + 1.0 / 479001600.0;
  p = p * z - 1.0 / 3628800.0;
  p = p * z + 1.0 / 40320.0;
  p = p * z - 1.0 / 720.0;
  p = p * z + 1.0 / 24.0;
  return 1.0 - (0.5 * z - z * z * p);
}

SinCos turnByQuarters(SinCos near, int quarters) {
  switch (quarters & 3) {
    case 0:
      return near;
    case 1:
      return {near.cos, -near.sin};
    case 2:
      return {-near.sin, -near.cos};
    default:
      return {-near.cos, near.sin};
  }
}

}  // namespace

SinCos sinCos(double x) {
  // Cody and Waite: pi/2 in three parts, the first two with 33 significant bits each, so that their products
  // with a quarter count below 2^20 are exact.
  constexpr double kPart1 = 0x1.921fb544p+0, kPart2 = 0x1.0b4611a6p-34, kPart3 = 0x1.3198a2e037073p-69;
  const double quarters = std::floor(x * (2.0 / kPi) + 0.5);
  const double reduced = ((x - quarters * kPart1) - quarters * kPart2) - quarters * kPart3;
  return turnByQuarters({sinNear0(reduced), cosNear0(reduced)}, static_cast<int>(static_cast<long long>(quarters) & 3));
}

SinCos sinCosOfTurn(int numerator, int denominator) {
  // Fold onto the first eighth of a turn with integers, so that symmetric slots get mirrored bits.
  const long long n8 = 8LL * numerator;
  const int octant = static_cast<int>(n8 / denominator);  // 0..7
  const long long rest = n8 - static_cast<long long>(octant) * denominator;
  const bool falling = (octant & 1) != 0;
  const double fraction = static_cast<double>(falling ? denominator - rest : rest) / static_cast<double>(denominator);
  const double angle = fraction * (kPi / 4.0);
  SinCos near{sinNear0(angle), cosNear0(angle)};
  if (falling && rest == 0) near = {std::sqrt(0.5), std::sqrt(0.5)};  // an eighth of a turn: one value for both
  if (falling) near = {near.cos, near.sin};
  return turnByQuarters(near, octant / 2);
}

}  // namespace spinaltap
