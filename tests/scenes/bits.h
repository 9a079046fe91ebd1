// tests/scenes/bits.h - every last bit of what the live loop computes in doubles, as one hash.
// A scene's state hash knows only which points went and what was felt; the predicate's touch absorbs rounding on
// purpose, so a build that contracted a * b + c could still end in the golden hashes. It cannot end in this one.
#pragma once
#include <cstdint>

#include "core/base/hash.h"
#include "core/base/random.h"
#include "core/drill/bounds.h"
#include "core/point_volume/lattice.h"
#include "core/session/scenes.h"

namespace spinaltap {

inline std::uint64_t combineVec3(std::uint64_t hash, const Vec3& v) {
  return combine(combine(combine(hash, bitsOf(v.x)), bitsOf(v.y)), bitsOf(v.z));
}

inline std::uint64_t hashOfBits() {
  std::uint64_t hash = 0;
  const point_volume::Lattice lattice = session::reportLattice();
  const point_volume::DiscTable table = point_volume::discTable(lattice);
  for (const double x : table.x_mm) hash = combine(hash, bitsOf(x));
  for (const double y : table.y_mm) hash = combine(hash, bitsOf(y));
  const drill::BitShape shape = drill::shapeOf(session::reportBit());
  for (std::uint64_t cycle = 0; cycle < 38000; cycle += 7) {
    const session::Input input = session::sceneInput(session::Scene::Hand, cycle);
    hash = combineVec3(combineVec3(hash, input.tip_mm), input.axis);
    const drill::Circle circle = drill::sectionCircle(shape, {input.tip_mm, input.axis}, lattice.discZ_mm(5));
    hash = combineVec3(hash, {circle.x_mm, circle.y_mm, circle.radius_mm});
    const drill::PolarCircle polar = drill::polar(circle);
    hash = combineVec3(hash, {polar.distance_mm, polar.angle_rad, polar.radius_mm});
  }
  // Every force and place of a bit that a hand pulls at, into bone, aside, back, and stopped.
  session::Config config{session::reportBit()};
  config.coupling = haptics::Coupling{};
  Random random(42);
  session::Session session = session::Session::create(*session::sceneVolume(40), config).value();
  for (std::uint64_t cycle = 0; cycle < 3000; ++cycle) {
    session::Input input = session::sceneInput(session::Scene::Hand, 2 * cycle, -0.5);
    const double aside = random.unit();  // arguments would be evaluated in either order
    input.tip_mm.x += cycle % 500 > 400 ? aside : 0.0;
    input.spinning = cycle % 900 < 800;
    hash = combine(hash, session.step(input).state_hash);
  }
  return hash;
}

}  // namespace spinaltap
