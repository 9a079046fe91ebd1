#include "core/phantom/anatomy.h"

#include <cmath>

#include "core/base/dmath.h"
#include "core/base/random.h"
#include "core/phantom/shapes.h"

namespace spinaltap::phantom {
namespace {

double square(double x) { return x * x; }

/// Distance from the midline, rounded off within a millimetre so that mirrored parts meet without a crease.
double fromMidline(double x) { return std::sqrt(x * x + 0.6); }

/// Half sizes of a plate: along, across, and the radius of its corners.
struct Half {
  double length, width, corner;
};

/// A plate whose second axis is `across` made orthogonal to the first.
Plate plate(const Vec3& centre, const Vec3& along, const Vec3& across, const Half& half) {
  const Vec3 a = normalized(along);
  return {centre, a, normalized(across - a * dot(a, across)), half.length, half.width, half.corner};
}

/// Slow bending of space, under half a millimetre: bones are not mirror images.
Vec3 warped(const Anatomy& an, const Vec3& p) {
  const double* f = an.warp_phase;
  return {p.x + 0.30 * sinCos(0.11 * p.y + 0.07 * p.z + f[0]).sin + 0.12 * sinCos(0.23 * p.z - 0.19 * p.x + f[1]).sin,
          p.y + 0.30 * sinCos(0.09 * p.x + 0.10 * p.z + f[2]).sin + 0.12 * sinCos(0.21 * p.x + 0.24 * p.z + f[3]).sin,
          p.z + 0.35 * sinCos(0.08 * p.x - 0.08 * p.y + f[4]).sin + 0.12 * sinCos(0.25 * p.y + 0.17 * p.x + f[5]).sin};
}

/// The body's section: 1 on its outline, less inside, with the reciprocal of the gradient's length for scale.
struct Section {
  double value, scale;
};

Section section(const Anatomy& an, const Vec3& p) {
  // Waisted: the width grows towards the rims.
  const double flare = smoothStep(0.0, 1.5, square(p.z / an.half_height)) / smoothStep(0.0, 1.5, 1.0);
  const double a = an.waist_half_width + (an.rim_half_width - an.waist_half_width) * flare;
  const double b = an.waist_half_depth + (an.rim_half_depth - an.waist_half_depth) * flare;
  // Bent backwards like a kidney: the back wall turns concave, the front stays round.
  const double u = p.x / a;
  const double flat = 1.0 / (1.0 + p.x * p.x / 2500.0);  // far to the side the bend would only steepen the field
  const double v = (p.y - an.kidney * (p.x * p.x * flat - 130.0)) / b;
  // Between an ellipse (2) and a squarer oval (0); squarer at the back.
  const double c = 0.8 - 0.55 * v / std::sqrt(1.0 + v * v);
  const double u2 = u * u, v2 = v * v;
  const double n4 = u2 * u2 + c * u2 * v2 + v2 * v2;
  const double n = std::sqrt(std::sqrt(n4 + 1e-12));
  const double n3 = n * n * n;
  const double gu = u * (u2 + 0.5 * c * v2) / n3, gv = v * (v2 + 0.5 * c * u2) / n3;
  const double gx = gu / a - gv * 2.0 * an.kidney * p.x * flat * flat / b, gy = gv / b;
  const double g = std::sqrt(gx * gx + gy * gy);
  const double trust = smoothStep(0.1, 0.9, n);  // the gradient has no limit in the middle
  return {n, b + (1.0 / std::max(g, 1e-3) - b) * trust};
}

double bodyOf(const Anatomy& an, const Vec3& p) {
  // The bend would steepen the field without end far away: from a box around the body on, count plain distance.
  constexpr double kBox = 36.0;
  const Vec3 near{std::clamp(p.x, -kBox, kBox), std::clamp(p.y, -kBox, kBox), p.z};
  const Section s = section(an, near);
  const double side = (s.value - 1.0) * s.scale + norm(p - near);
  // The endplate: a flat ring under the rim, and a dish inside it.
  const double dish = an.endplate_dish * square(std::max(1.0 - 1.3 * square(s.value), 0.0));
  const double height = an.half_height - an.wedge * p.y;
  const double ends = std::fabs(p.z) - height + dish;
  // The basivertebral vein's opening in the middle of the back wall.
  const double vein = norm(Vec3{p.x / 1.7, p.y - (an.waist_half_depth - 0.6), p.z}) - 1.5;
  return smoothMax(smoothMax(side, ends, 3.0), -vein, 2.0);
}

double canalOf(const Anatomy& an, const Vec3& p) {
  const double x = fromMidline(p.x);
  const double wall = x - an.canal_half_width;
  const double lamina = 0.59 * x + 0.807 * (p.y - an.canal_apex_y);
  const double front = 8.0 - p.y;
  return smoothMax(smoothMax(wall, lamina, 6.0), front, 2.0);
}

/// `m` is the point mirrored to the left side.
double pedicleOf(const Anatomy& an, const Vec3& m) {
  const double flat = an.pedicle_half_height - an.pedicle_half_width;
  const Plate blank = plate(pedicleIsthmus(an, 1), pedicleAxis(an, 1), {0, 0, 1}, {10.0, flat, 0.0});
  const Plate::Local at = blank.nearest(m);
  return at.distance - (an.pedicle_half_width + 0.014 * at.along * at.along);
}

/// Lamina and the neck (pars) between the articular processes: one sheet, sloping back as it goes down.
double laminaOf(const Anatomy& an, const Vec3& m) {
  const double y = an.canal_apex_y;
  const Plate sheet = plate({7.6, y - 2.0, -9.0}, {-0.82, 0.57, 0}, {0.05, 0.24, -1}, {8.8, 8.0, 3.0});
  const double neck = capsule(m, {16.6, y - 6.0, 3.0}, {13.0, y + 0.5, -12.0}, 4.2, 3.6);
  return smoothMin(sheet.nearest(m).distance - 2.7, neck, 4.0);
}

double spinousOf(const Anatomy& an, const Vec3& p) {
  const double front = an.canal_apex_y + 2.0, back = an.spinous_tip_y - 3.8;
  const Plate hatchet =
      plate({0, 0.5 * (front + back), -11.2}, {0, 1, -0.12}, {0, 0, 1}, {0.5 * (back - front), 6.7, 4.5});
  const Plate::Local at = hatchet.nearest(p, 0.13);
  const double tip = smoothStep(0.2, 1.0, at.along / hatchet.half_length);
  const double root = smoothStep(-0.5, -1.0, at.along / hatchet.half_length);
  const double low = smoothStep(-1.0, -7.0, at.across);
  return at.distance - (2.5 + 1.2 * tip + 0.9 * root + 0.9 * low);
}

double transverseOf(const Anatomy& an, const Vec3& m) {
  const double y = an.canal_apex_y;
  const Vec3 root{17.5, y - 7.5, 2.6}, bend{29.0, y - 3.6, 3.6}, tip{an.transverse_span - 2.2, y + 4.0, 5.2};
  const double half_inner = 0.5 * norm(bend - root), half_outer = 0.5 * norm(tip - bend);
  const Plate inner = plate((root + bend) * 0.5, bend - root, {0, 0, 1}, {half_inner, 3.6, 2.2});
  const Plate outer = plate((bend + tip) * 0.5, tip - bend, {0, 0, 1}, {half_outer, 2.6, 2.0});
  const Plate::Local a = inner.nearest(m, -0.10), b = outer.nearest(m, -0.05);
  return smoothMin(a.distance - (2.6 - 0.05 * a.along), b.distance - (2.15 - 0.008 * b.along), 3.0);
}

/// A blade that stands beside the canal, bulging to the back into the mammillary process; its hollow side is the facet.
double superiorArticularOf(const Anatomy& an, const Vec3& m) {
  const double k = an.articular_scale, y = an.canal_apex_y;
  const Plate blade = plate({18.2, y - 2.2, 8.9}, {-0.06, 0.0, 1}, {0.50, 0.866, 0}, {6.0 * k, 5.0 * k, 4.5 * k});
  double s = blade.nearest(m).distance - 2.6;
  s = smoothMin(s, capsule(m, {21.0, y + 1.6, 7.8}, {20.8, y + 2.0, 10.7}, 2.4, 2.2), 4.0);
  const double hollow = std::sqrt(square(m.x - 8.0) + square(m.y - (y + 5.2))) - 11.2;
  return smoothMax(s, -hollow, 1.6);
}

/// Hangs from the lamina; rounded in front and to the side, where it fits the hollow of the vertebra below.
double inferiorArticularOf(const Anatomy& an, const Vec3& m) {
  const double k = an.articular_scale, y = an.canal_apex_y;
  const Plate blade = plate({12.2, y + 1.8, -14.8}, {-0.03, 0.12, -1}, {0.74, 0.67, 0}, {7.7 * k, 3.6 * k, 3.4 * k});
  const Plate::Local at = blade.nearest(m);
  return at.distance - (3.2 - 0.05 * at.along);
}

/// Joins `part(m)` to s by smoothMin, skipping it where it cannot matter: every part stays outside its ball, and
/// beyond k the smooth union is the plain one. The result is the same to the bit; tests compare.
struct Ball {
  Vec3 centre;
  double radius;
};

template <class Part>
double joined(double s, double k, const Ball& ball, const Vec3& m, const Part& part) {
  const Vec3 d = m - ball.centre;
  const double reach = s + k + ball.radius;
  if (reach < 0 || dot(d, d) > reach * reach) return s;
  return smoothMin(s, part(), k);
}

double archOf(const Anatomy& an, const Vec3& p, bool cull) {
  const double y = an.canal_apex_y, all = cull ? 0.0 : 1e3;
  const Vec3 m{fromMidline(p.x), p.y, p.z};
  const double span = an.transverse_span, tip = an.spinous_tip_y;
  double s = pedicleOf(an, m);
  s = joined(s, 4.0, {{11.0, y - 2.0, -6.0}, 19.0 + all}, m, [&] { return laminaOf(an, m); });
  s = joined(s, 5.0, {{12.2, y + 2.4, -14.8}, 13.5 + all}, m, [&] { return inferiorArticularOf(an, m); });
  s = joined(s, 7.0, {{0, 0.5 * (y + tip), -11.2}, 0.5 * (tip - y) + 15.0 + all}, p, [&] { return spinousOf(an, p); });
  s = joined(s, 6.0, {{0.5 * (span + 17.0), y - 2.0, 4.0}, 0.5 * (span - 17.0) + 11.0 + all}, m,
             [&] { return transverseOf(an, m); });
  s = joined(s, 4.0, {{23.5, y - 2.5, -1.5}, 1.5 + all}, m,
             [&] { return norm(m - Vec3{23.5, y - 2.5, -1.5}) - 1.4; });  // accessory process
  s = joined(s, 4.0, {{18.5, y - 2.0, 9.0}, 13.5 + all}, m, [&] { return superiorArticularOf(an, m); });
  return smoothMax(s, -canalOf(an, p), 2.5);
}

double bone(const Anatomy& an, const Vec3& local, bool cull) {
  const Vec3 p = warped(an, local);
  constexpr double kBlend = 4.5;
  const double body = bodyOf(an, p);
  // No part of the arch is in front of y = 2.
  if (cull && 2.0 - p.y > body + kBlend) return body;
  return smoothMin(body, archOf(an, p, cull), kBlend);
}

}  // namespace

Anatomy Anatomy::make(std::uint64_t seed) {
  Random random(combine(seed, 0x4c33));  // "L3"
  Anatomy an;
  const auto vary = [&random](double& value, double part) { value *= random.uniform(1.0 - part, 1.0 + part); };
  vary(an.rim_half_width, 0.03);
  an.waist_half_width = an.rim_half_width * random.uniform(0.83, 0.86);
  vary(an.rim_half_depth, 0.03);
  an.waist_half_depth = an.rim_half_depth * random.uniform(0.905, 0.93);
  vary(an.half_height, 0.025);
  vary(an.wedge, 0.5);
  vary(an.endplate_dish, 0.2);
  vary(an.kidney, 0.1);
  vary(an.pedicle_half_width, 0.06);
  vary(an.pedicle_half_height, 0.04);
  vary(an.pedicle_angle, 0.15);
  vary(an.canal_half_width, 0.03);
  vary(an.canal_apex_y, 0.02);
  vary(an.transverse_span, 0.05);
  vary(an.spinous_tip_y, 0.03);
  vary(an.articular_scale, 0.06);
  for (double& phase : an.warp_phase) phase = random.uniform(0.0, 2.0 * kPi);
  return an;
}

double boneDistance(const Anatomy& an, const Vec3& local) { return bone(an, local, true); }

double boneDistanceUnskipped(const Anatomy& an, const Vec3& local) { return bone(an, local, false); }

double bodyDistance(const Anatomy& an, const Vec3& local) { return bodyOf(an, warped(an, local)); }

double bodyOutline(const Anatomy& an, const Vec3& local) {
  const Section s = section(an, warped(an, local));
  return (s.value - 1.0) * s.scale;
}

double canalDistance(const Anatomy& an, const Vec3& local) { return canalOf(an, warped(an, local)); }

Vec3 pedicleIsthmus(const Anatomy& an, double side) {
  return {side * (an.canal_half_width + an.pedicle_half_width + 0.3), 20.5, 4.4};
}

Vec3 pedicleAxis(const Anatomy& an, double side) {
  const SinCos angle = sinCos(an.pedicle_angle);
  return {-side * angle.sin, -angle.cos, 0};
}

}  // namespace spinaltap::phantom
