#include "wasm/hand_binding.h"

#include <emscripten/bind.h>

#include <cmath>

#include "wasm/session_binding.h"

namespace spinaltap::wasm {
namespace {

haptics::Grip gripOf(double mass_kg, double damping_N_s_mm, double stiffness_N_mm) {
  const auto orElse = [](double value, bool ok, double fallback) {
    return ok && std::isfinite(value) ? value : fallback;
  };
  const haptics::Grip usual = haptics::leaningGrip();
  return {orElse(mass_kg, mass_kg > 0, usual.mass_kg),
          orElse(damping_N_s_mm, damping_N_s_mm >= 0, usual.damping_N_s_mm),
          orElse(stiffness_N_mm, stiffness_N_mm >= 0, usual.stiffness_N_mm)};
}

}  // namespace

HandBinding::HandBinding(double mass_kg, double damping_N_s_mm, double across_N_mm)
    : along_(gripOf(mass_kg, damping_N_s_mm, 0)), across_(gripOf(mass_kg, damping_N_s_mm, across_N_mm)) {}

void HandBinding::place(const Vec3& at_mm) {
  along_.place(at_mm);
  across_.place({});
}

void HandBinding::step(double seconds, const Vec3& axis, double push_N, const Vec3& aim_mm, const Vec3& reaction_N) {
  const double back_N = dot(reaction_N, axis);
  const Vec3 off_mm = aim_mm - at();
  along_.step(along_.at_mm(), axis * push_N, axis * back_N, seconds);
  across_.step(across_.at_mm() + (off_mm - axis * dot(off_mm, axis)), {}, reaction_N - axis * back_N, seconds);
}

void bindHand() {
  emscripten::class_<HandBinding>("Hand")
      .constructor<double, double, double>()
      .function("place", &HandBinding::place)
      .function("step", &HandBinding::step)
      .function("at", &HandBinding::at)
      .function("velocity", &HandBinding::velocity);
}

}  // namespace spinaltap::wasm
