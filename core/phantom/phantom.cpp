#include "core/phantom/phantom.h"

#include <algorithm>
#include <cmath>

#include "core/base/dmath.h"
#include "core/base/random.h"
#include "core/phantom/tissue.h"

namespace spinaltap::phantom {

struct Phantom::State {
  PhantomOptions options;
  Anatomy anatomy;
  Frame frame;
  Tissue tissue;
  PediclePath left, right;
};

namespace {

/// An ordinary place in an ordinary scanner, the vertebra turned a few degrees as people lie.
Frame placed(std::uint64_t seed) {
  Random random(combine(seed, 0x706f73));
  Frame frame;
  frame.origin_patient = {random.uniform(-8.0, 8.0), 120.0 + random.uniform(-8.0, 8.0),
                          -840.0 + random.uniform(-8.0, 8.0)};
  constexpr double kDegree = kPi / 180.0;
  const SinCos a = sinCos(random.uniform(-3.0, 3.0) * kDegree);  // about x: lordosis
  const SinCos b = sinCos(random.uniform(-1.5, 1.5) * kDegree);  // about y: leaning
  const SinCos c = sinCos(random.uniform(-2.5, 2.5) * kDegree);  // about z: turned
  const auto turned = [&](Vec3 v) {
    v = {v.x, a.cos * v.y - a.sin * v.z, a.sin * v.y + a.cos * v.z};
    v = {b.cos * v.x + b.sin * v.z, v.y, -b.sin * v.x + b.cos * v.z};
    return Vec3{c.cos * v.x - c.sin * v.y, c.sin * v.x + c.cos * v.y, v.z};
  };
  frame.axes = {turned({1, 0, 0}), turned({0, 1, 0}), turned({0, 0, 1})};
  return frame;
}

/// Where the ray first leaves bone. @pre it starts inside.
double exitAlong(const Anatomy& an, const Vec3& from, const Vec3& direction) {
  double low = 0, high = 0;
  while (boneDistance(an, from + direction * high) < 0) low = high, high += 0.25;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (boneDistance(an, from + direction * middle) < 0 ? low : high) = middle;
  }
  return low;
}

PediclePath pathOf(const Anatomy& an, const Frame& frame, Side which) {
  const double side = which == Side::Left ? 1.0 : -1.0;
  // A little below the middle of the pedicle, so that the drill enters under the superior articular process.
  const Vec3 isthmus = pedicleIsthmus(an, side) - Vec3{0, 0, 1.6}, ahead = pedicleAxis(an, side);
  const Vec3 across = cross(ahead, {0, 0, 1}), up{0, 0, 1};
  const double front = exitAlong(an, isthmus, ahead), back = exitAlong(an, isthmus, -ahead);
  // The body begins where its own surface crosses the axis.
  double body = 0;
  while (bodyDistance(an, isthmus + ahead * body) > 0) body += 0.05;
  PediclePath path;
  path.entry_patient = frame.toPatient(isthmus - ahead * back);
  path.target_patient = frame.toPatient(isthmus + ahead * (body + 0.8 * (front - body)));
  path.isthmus_patient = frame.toPatient(isthmus);
  path.width_mm = exitAlong(an, isthmus, across) + exitAlong(an, isthmus, -across);
  path.height_mm = exitAlong(an, isthmus, up) + exitAlong(an, isthmus, -up);
  return path;
}

}  // namespace

Phantom Phantom::make(const PhantomOptions& options) {
  auto state = std::make_shared<State>();
  state->options = options;
  state->anatomy = Anatomy::make(options.seed);
  state->frame = placed(options.seed);
  state->tissue = {mix64(options.seed ^ 0x7469737375ULL), options.osteoporotic};
  state->left = pathOf(state->anatomy, state->frame, Side::Left);
  state->right = pathOf(state->anatomy, state->frame, Side::Right);
  return Phantom(std::move(state));
}

double Phantom::signedDistance(const Vec3& patient) const {
  return boneDistance(state_->anatomy, state_->frame.toLocal(patient));
}

Vec3 Phantom::gradient(const Vec3& patient) const {
  constexpr double kHalf = 1e-5;  // rounding 1e-13 / 2e-5 and curvature 1e-10: each below 1e-8
  const Vec3 p = state_->frame.toLocal(patient);
  const auto slope = [&](const Vec3& step) {
    return (boneDistance(state_->anatomy, p + step) - boneDistance(state_->anatomy, p - step)) / (2.0 * kHalf);
  };
  return state_->frame.directionToPatient({slope({kHalf, 0, 0}), slope({0, kHalf, 0}), slope({0, 0, kHalf})});
}

Field Phantom::field() const {
  Field field;
  field.values = [copy = *this](std::span<const Vec3> points, std::span<double> out) {
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = copy.signedDistance(points[i]);
  };
  field.gradients = [copy = *this](std::span<const Vec3> points, std::span<Vec3> out) {
    for (std::size_t i = 0; i < points.size(); ++i) out[i] = copy.gradient(points[i]);
  };
  field.lipschitz = kLipschitz;
  return field;
}

double Phantom::distanceToSurface(const Vec3& patient) const {
  const auto onto = [this](Vec3 x) {  // Newton along the gradient
    for (int i = 0; i < 40; ++i) {
      const double s = signedDistance(x);
      if (std::fabs(s) < 1e-12) break;
      const Vec3 g = gradient(x);
      x -= g * (s / std::max(dot(g, g), 0.05));
    }
    return x;
  };
  const double sign = signedDistance(patient) < 0 ? -1.0 : 1.0;
  Vec3 foot = onto(patient);
  double best = norm(patient - foot);
  // Slide the foot until the line to the point is normal: drop the point onto the tangent plane, return to the surface.
  for (int i = 0; i < 100; ++i) {
    const Vec3 normal = normalized(gradient(foot));
    const Vec3 next = onto(patient - normal * dot(patient - foot, normal));
    const double moved = norm(next - foot);
    foot = next;
    if (std::fabs(signedDistance(foot)) < 1e-9) best = std::min(best, norm(patient - foot));
    if (moved < 1e-8) break;
  }
  return sign * best;
}

double Phantom::trueHu(const Vec3& patient) const {
  const Vec3 local = state_->frame.toLocal(patient);
  const double s = boneDistance(state_->anatomy, local);
  return s < 0 ? state_->tissue.boneHu(state_->anatomy, local, -s) : state_->tissue.softHu(state_->anatomy, local);
}

const PediclePath& Phantom::pedicle(Side side) const { return side == Side::Left ? state_->left : state_->right; }
const Frame& Phantom::frame() const { return state_->frame; }
const Anatomy& Phantom::anatomy() const { return state_->anatomy; }
const Tissue& Phantom::tissue() const { return state_->tissue; }
const PhantomOptions& Phantom::options() const { return state_->options; }

Vec3 Phantom::seedPoint() const { return state_->frame.toPatient({0, -2, -1}); }

Bounds Phantom::bounds() const {
  const Anatomy& an = state_->anatomy;
  const Vec3 low{-an.transverse_span - 2, -an.rim_half_depth - 5, -31};
  const Vec3 high{an.transverse_span + 2, an.spinous_tip_y + 3, 22};
  Bounds box{state_->frame.toPatient(low), state_->frame.toPatient(low)};
  for (int corner = 1; corner < 8; ++corner) {
    const Vec3 local{corner & 1 ? high.x : low.x, corner & 2 ? high.y : low.y, corner & 4 ? high.z : low.z};
    const Vec3 p = state_->frame.toPatient(local);
    Vec3 &l = box.low_patient, &h = box.high_patient;
    l = {std::min(l.x, p.x), std::min(l.y, p.y), std::min(l.z, p.z)};
    h = {std::max(h.x, p.x), std::max(h.y, p.y), std::max(h.z, p.z)};
  }
  return box;
}

}  // namespace spinaltap::phantom
