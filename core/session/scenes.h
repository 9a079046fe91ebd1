// core/session/scenes.h - three scripted drills on one bare volume, shared by tests, benchmarks, the program and the
// browser. Their sines are the program's own, so a scene's inputs are the same bits on every target.
#pragma once
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/plan/path.h"
#include "core/point_volume/point_volume.h"
#include "core/session/session.h"

namespace spinaltap::session {

/// on:   0.01 mm a cycle along the path's axis.
/// off:  the same, 1 mm beside it (x = 1 mm).
/// hand: 0.001 mm a cycle with a hand's tremor at 9 Hz and a tilt that grows to 2 degrees.
enum class Scene { On, Off, Hand };

/// @error NotFound, naming the scenes there are.
[[nodiscard]] Result<Scene> sceneNamed(std::string_view name);
[[nodiscard]] std::string_view nameOf(Scene scene);
[[nodiscard]] std::vector<std::string_view> sceneNames();

/// One cycle is 1 ms: t_us = 1000 * cycle; the tip begins at z = start_z_mm.
/// @pre cycle <= kMostSceneCycles (the sines' domain).
inline constexpr std::uint64_t kMostSceneCycles = 5'000'000;
[[nodiscard]] Input sceneInput(Scene scene, std::uint64_t cycle, double start_z_mm = 0);

/// Cycles 0 .. sceneCycles - 1 bring the tip from start_z_mm to start_z_mm + length_mm; at most kMostSceneCycles.
/// @pre length_mm >= 0, finite.
[[nodiscard]] std::uint64_t sceneCycles(Scene scene, double length_mm);

/// The report's realistic path: 378 discs of a centre and 29 rings at 0.1 mm, 986,958 points.
[[nodiscard]] point_volume::Lattice reportLattice();
/// 3.0 mm wide, 5 mm cone, 50 mm long.
[[nodiscard]] plan::Bit reportBit();
inline constexpr double kReportLength_mm = 37.8;
/// The density of every point of a scene volume: cancellous bone.
inline constexpr std::uint16_t kSceneDensity_mg_cm3 = 300;

/// The scene volume: reportLattice(), or its first `discs` discs, all alive.
/// @error as point_volume::checkLattice.
[[nodiscard]] Result<point_volume::PointVolume> sceneVolume(int discs = 378);

struct SceneResult {
  std::uint64_t state_hash = 0;
  std::uint64_t removed = 0;
  std::uint64_t cycles = 0;
};

/// Runs cycles 0 .. cycles-1 of a scene on sceneVolume(discs) with reportBit().
/// @error as sceneVolume and Session::create; Limit, above kMostSceneCycles.
[[nodiscard]] Result<SceneResult> runScene(Scene scene, std::string_view engine, std::uint64_t cycles, int discs = 378);

}  // namespace spinaltap::session
