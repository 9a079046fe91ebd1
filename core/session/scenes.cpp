#include "core/session/scenes.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <string>
#include <utility>

#include "core/base/dmath.h"

namespace spinaltap::session {
namespace {

double stepOf(Scene scene) { return scene == Scene::Hand ? 0.001 : 0.01; }

void holdByHand(double t_s, Input& input) {
  const double w = 2.0 * kPi * 9.0;
  input.tip_mm.x = 0.10 * sinCos(w * t_s).sin + 0.05 * sinCos(1.7 * w * t_s + 1.0).sin;
  input.tip_mm.y = 0.10 * sinCos(0.83 * w * t_s).cos + 0.05 * sinCos(0.31 * w * t_s).sin;
  const double tilt_deg = 2.0 * std::min(1.0, t_s / 20.0) + 0.3 * sinCos(0.9 * w * t_s).sin;
  const SinCos tilt = sinCos(tilt_deg * (kPi / 180.0));
  const SinCos azimuth = sinCos(0.3 * t_s);
  input.axis = {tilt.sin * azimuth.cos, tilt.sin * azimuth.sin, tilt.cos};
}

}  // namespace

Result<Scene> sceneNamed(std::string_view name) {
  for (const Scene scene : {Scene::On, Scene::Off, Scene::Hand}) {
    if (name == nameOf(scene)) return scene;
  }
  return fail(ErrorCode::NotFound, "no scene '" + std::string(name.substr(0, 40)) + "': there are on, off and hand");
}

std::string_view nameOf(Scene scene) {
  switch (scene) {
    case Scene::On:
      return "on";
    case Scene::Off:
      return "off";
    case Scene::Hand:
      break;
  }
  return "hand";
}

std::vector<std::string_view> sceneNames() { return {"on", "off", "hand"}; }

Input sceneInput(Scene scene, std::uint64_t cycle, double start_z_mm) {
  assert(cycle <= kMostSceneCycles);
  const auto i = static_cast<double>(cycle);
  Input input;
  input.t_us = 1000 * cycle;
  input.tip_mm.z = start_z_mm + stepOf(scene) * i;
  if (scene == Scene::Off) input.tip_mm.x = 1.0;
  if (scene == Scene::Hand) holdByHand(i * 0.001, input);
  return input;
}

std::uint64_t sceneCycles(Scene scene, double length_mm) {
  assert(length_mm >= 0);
  const double steps = std::floor(length_mm / stepOf(scene) + 0.5);
  return static_cast<std::uint64_t>(std::min(steps + 1.0, static_cast<double>(kMostSceneCycles)));
}

point_volume::Lattice reportLattice() { return {0.1, 30, 378, 0}; }

plan::Bit reportBit() { return {3.0, 5.0, 50.0}; }

Result<point_volume::PointVolume> sceneVolume(int discs) {
  point_volume::Lattice lattice = reportLattice();
  lattice.discs = discs;
  return point_volume::solidVolume(lattice, kSceneDensity_mg_cm3);
}

Result<SceneResult> runScene(Scene scene, std::string_view engine, std::uint64_t cycles, int discs) {
  if (cycles > kMostSceneCycles) return fail(ErrorCode::Limit, "scene: more than 5,000,000 cycles");
  auto volume = sceneVolume(discs);
  if (!volume) return tl::unexpected(volume.error());
  auto session = Session::create(std::move(*volume), {reportBit(), std::string(engine)});
  if (!session) return tl::unexpected(session.error());
  SceneResult result;
  result.state_hash = session->stateHash();
  for (std::uint64_t cycle = 0; cycle < cycles; ++cycle) {
    const Output output = session->step(sceneInput(scene, cycle));
    result = {output.state_hash, output.removed_total, output.cycle};
  }
  return result;
}

}  // namespace spinaltap::session
