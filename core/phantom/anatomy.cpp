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

/// Two unit vectors of a plate's plane: `along` as given, `up` made orthogonal to it.
Plate plate(const Vec3& centre, const Vec3& along, const Vec3& up, double half_length, double half_width) {
  const Vec3 a = normalized(along);
  return {centre, a, normalized(up - a * dot(a, up)), half_length, half_width};
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
  // Waisted: the width grows towards the rims, most of it in the last few millimetres.
  const double t = std::min(square(p.z / an.half_height), 1.3);
  const double flare = 0.45 * t + 0.55 * t * t * t;
  const double a = an.waist_half_width + (an.rim_half_width - an.waist_half_width) * std::min(flare, 1.15);
  const double b = an.waist_half_depth + (an.rim_half_depth - an.waist_half_depth) * std::min(flare, 1.15);
  // Bent backwards like a kidney: the back wall turns concave, the front stays round.
  const double u = p.x / a;
  const double v = (p.y - an.kidney * p.x * p.x + 0.9) / b;
  // Between an ellipse (2) and a squarer oval (0); squarer at the back.
  const double c = 1.15 - 0.75 * v / std::sqrt(1.0 + v * v);
  const double u2 = u * u, v2 = v * v;
  const double n4 = u2 * u2 + c * u2 * v2 + v2 * v2;
  const double n = std::sqrt(std::sqrt(n4 + 1e-12));
  const double n3 = n * n * n;
  const double gu = u * (u2 + 0.5 * c * v2) / n3, gv = v * (v2 + 0.5 * c * u2) / n3;
  const double gx = gu / a - gv * 2.0 * an.kidney * p.x / b, gy = gv / b;
  const double g = std::sqrt(gx * gx + gy * gy);
  const double trust = smoothStep(0.1, 0.9, n);  // the gradient has no limit in the middle
  return {n, b + (1.0 / std::max(g, 1e-3) - b) * trust};
}

double bodyOf(const Anatomy& an, const Vec3& p) {
  const Section s = section(an, p);
  const double side = (s.value - 1.0) * s.scale;
  const double dish = an.endplate_dish * square(std::max(1.0 - 1.15 * square(s.value), 0.0));
  const double height = an.half_height - an.wedge * p.y;
  const double ends = std::fabs(p.z) - height + dish;
  // The basivertebral vein's opening in the middle of the back wall.
  const double vein = norm(Vec3{p.x / 1.6, p.y - (an.waist_half_depth + 0.3), p.z}) - 1.6;
  return smoothMax(smoothMax(side, ends, 2.2), -vein, 2.0);
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
  const Plate blank =
      plate(pedicleIsthmus(an, 1), pedicleAxis(an, 1), {0, 0, 1}, 10.0, an.pedicle_half_height - an.pedicle_half_width);
  const Plate::Local at = blank.nearest(m);
  return at.distance - (an.pedicle_half_width + 0.014 * at.along * at.along);
}

double laminaOf(const Anatomy& an, const Vec3& m) {
  const double y = an.canal_apex_y;
  const Plate blank = plate({8.0, y - 2.6, -8.0}, {-0.81, 0.59, 0}, {0, 0.22, -1}, 8.5, 6.8);
  return blank.nearest(m).distance - 2.9;
}

double spinousOf(const Anatomy& an, const Vec3& p) {
  const double front = an.canal_apex_y + 4.0, middle = 0.5 * (front + an.spinous_tip_y - 3.5);
  const Plate blank = plate({0, middle, -11.5}, {0, 1, -0.13}, {0, 0, 1}, an.spinous_tip_y - 3.5 - middle, 6.6);
  const Plate::Local at = blank.nearest(p, 0.11);
  const double tip = smoothStep(0.1, 1.0, at.along / blank.half_length);
  const double low = smoothStep(-0.2, -1.0, at.across / 7.0);
  return at.distance - (2.9 + 1.1 * tip + 0.8 * low);
}

double transverseOf(const Anatomy& an, const Vec3& m) {
  const double reach = an.transverse_span - 2.3;
  const Vec3 root{19.0, an.canal_apex_y - 6.5, 2.5}, tip{reach, an.canal_apex_y - 0.5, 5.5};
  const Vec3 along = tip - root;
  const double half = 0.5 * norm(along);
  const Plate blank = plate((root + tip) * 0.5, along, {0, 0, 1}, half, 2.9);
  const Plate::Local at = blank.nearest(m, -0.07);
  return at.distance - (2.5 - 0.025 * at.along);
}

double superiorArticularOf(const Anatomy& an, const Vec3& m) {
  const double k = an.articular_scale, y = an.canal_apex_y;
  const Plate blank = plate({17.6, y - 2.6, 9.0}, {0, 0.05, 1}, {0.66, 0.75, 0}, 6.0 * k, 3.9 * k);
  double s = blank.nearest(m).distance - 3.4;
  s = smoothMin(s, norm(m - Vec3{20.8, y + 2.4, 8.5}) - 2.9, 4.0);  // mammillary process
  // The facet: a hollow that faces back and towards the midline.
  const double hollow = std::sqrt(square(m.x - 8.6) + square(m.y - (y + 6.2))) - 10.3;
  return smoothMax(s, -hollow, 1.5);
}

double inferiorArticularOf(const Anatomy& an, const Vec3& m) {
  const double k = an.articular_scale, y = an.canal_apex_y;
  const Plate blank = plate({11.8, y + 3.4, -17.0}, {0.04, 0.05, -1}, {0.66, 0.75, 0}, 6.8 * k, 2.9 * k);
  return blank.nearest(m).distance - 3.5;
}

double archOf(const Anatomy& an, const Vec3& p) {
  const double y = an.canal_apex_y;
  const Vec3 m{fromMidline(p.x), p.y, p.z};
  double s = smoothMin(pedicleOf(an, m), capsule(m, {17.0, y - 5.0, 4.0}, {12.4, y + 2.0, -12.0}, 4.4, 3.8), 5.0);
  s = smoothMin(s, laminaOf(an, m), 4.0);
  s = smoothMin(s, inferiorArticularOf(an, m), 4.0);
  s = smoothMin(s, spinousOf(an, p), 5.0);
  s = smoothMin(s, transverseOf(an, m), 5.0);
  s = smoothMin(s, norm(m - Vec3{23.0, y - 1.5, -1.0}) - 1.8, 4.0);  // accessory process
  s = smoothMin(s, superiorArticularOf(an, m), 3.0);
  return smoothMax(s, -canalOf(an, p), 2.5);
}

}  // namespace

Anatomy Anatomy::make(std::uint64_t seed) {
  Random random(combine(seed, 0x4c33));  // "L3"
  Anatomy an;
  const auto vary = [&random](double& value, double part) { value *= random.uniform(1.0 - part, 1.0 + part); };
  vary(an.rim_half_width, 0.03);
  an.waist_half_width = an.rim_half_width * random.uniform(0.875, 0.905);
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

double boneDistance(const Anatomy& an, const Vec3& local) {
  const Vec3 p = warped(an, local);
  return smoothMin(bodyOf(an, p), archOf(an, p), 4.5);
}

double bodyDistance(const Anatomy& an, const Vec3& local) { return bodyOf(an, warped(an, local)); }

double canalDistance(const Anatomy& an, const Vec3& local) { return canalOf(an, warped(an, local)); }

Vec3 pedicleIsthmus(const Anatomy& an, double side) {
  return {side * (an.canal_half_width + an.pedicle_half_width + 0.3), 20.5, 4.4};
}

Vec3 pedicleAxis(const Anatomy& an, double side) {
  const SinCos angle = sinCos(an.pedicle_angle);
  return {-side * angle.sin, -angle.cos, 0};
}

}  // namespace spinaltap::phantom
