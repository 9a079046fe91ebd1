// core/base/dmath.h - sine and cosine whose bits are the same on every target.
// libm's differ between C libraries; these use + - * only.
#pragma once

namespace spinaltap {

inline constexpr double kPi = 3.14159265358979323846;

struct SinCos {
  double sin, cos;
};

/// Sine and cosine of x radians. @pre |x| <= 1e6 (callers' angles are scene phases and ring angles).
/// Error: at most 2 units in the last place of 1 (absolute 4.5e-16), tested against libm in long double.
[[nodiscard]] SinCos sinCos(double x);

/// Sine and cosine of 2 pi * numerator / denominator, exact at multiples of a quarter turn and symmetric in
/// all eight octants. @pre 0 <= numerator < denominator <= 2^30.
[[nodiscard]] SinCos sinCosOfTurn(int numerator, int denominator);

}  // namespace spinaltap
