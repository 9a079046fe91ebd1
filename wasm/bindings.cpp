// wasm/bindings.cpp - what JavaScript sees of the core. See README.md.
#include <emscripten/bind.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "core/session/scenes.h"
#include "wasm/binding_help.h"
#include "wasm/session_binding.h"

namespace spinaltap::wasm {
namespace {

using emscripten::val;

std::string kept_error;

Result<val> sceneResult(const std::string& name, const std::string& engine, double cycles, double discs) {
  const Result<session::Scene> scene = session::sceneNamed(name);
  if (!scene) return tl::unexpected(scene.error());
  if (!(discs >= 0 && discs <= 1e6 && cycles >= 0)) return fail(ErrorCode::InvalidArgument, "scene: cycles or discs");
  const int disc_count = discs == 0 ? session::reportLattice().discs : static_cast<int>(discs);
  Result<point_volume::PointVolume> volume = session::sceneVolume(disc_count);
  if (!volume) return tl::unexpected(volume.error());
  const double length_mm = volume->lattice.spacing_mm * disc_count;
  Result<session::Session> session =
      session::Session::create(std::move(*volume), {session::reportBit(), engine.empty() ? "clearance" : engine});
  if (!session) return tl::unexpected(session.error());
  const std::uint64_t count =
      cycles == 0 ? session::sceneCycles(*scene, length_mm) : std::min(wholeOf(cycles), session::kMostSceneCycles);
  session::Output output;
  for (std::uint64_t i = 0; i < count; ++i) output = session->step(session::sceneInput(*scene, i));
  val result = val::object();
  result.set("hash", hexOf(session->stateHash()));
  result.set("removed", static_cast<double>(output.removed_total));
  result.set("cycles", static_cast<double>(output.cycle));
  return result;
}

val makeScene(const std::string& name, const std::string& engine, double cycles, double discs) {
  Result<val> result = sceneResult(name, engine, cycles, discs);
  if (result) return *result;
  keepError(std::move(result.error()));
  return val::null();
}

std::string takeError() { return std::move(kept_error); }
std::string version() { return SPINALTAP_VERSION; }

}  // namespace

void keepError(Error error) { kept_error = std::move(error.message); }

Result<std::vector<std::byte>> bytesOf(const val& array, const char* what) {
  if (!array.instanceof(val::global("Uint8Array"))) {
    return fail(ErrorCode::InvalidArgument, std::string(what) + ": not a Uint8Array");
  }
  std::vector<std::byte> bytes(array["length"].as<std::size_t>());
  val(emscripten::typed_memory_view(bytes.size(), reinterpret_cast<unsigned char*>(bytes.data())))
      .call<void>("set", array);
  return bytes;
}

val bytesToArray(const std::vector<std::byte>& bytes) {
  return val::global("Uint8Array")
      .new_(emscripten::typed_memory_view(bytes.size(), reinterpret_cast<const unsigned char*>(bytes.data())));
}

std::string hexOf(std::uint64_t hash) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

std::uint64_t wholeOf(double number) {
  constexpr double kMost = 9007199254740992.0;
  if (!(number > 0)) return 0;
  return static_cast<std::uint64_t>(number < kMost ? number : kMost);
}

val aliveBitsOf(const point_volume::PointVolume& volume) {
  std::vector<std::uint32_t> words;
  words.reserve(2 * volume.alive.size());
  for (const std::uint64_t word : volume.alive) {
    words.push_back(static_cast<std::uint32_t>(word));
    words.push_back(static_cast<std::uint32_t>(word >> 32));
  }
  return arrayOf("Uint32Array", words);
}

val floatsOf(const std::vector<splats::Splat>& splats) {
  std::vector<float> floats;
  floats.reserve(7 * splats.size());
  for (const splats::Splat& s : splats) {
    for (const double v : {s.position_mm.x, s.position_mm.y, s.position_mm.z, s.normal.x, s.normal.y, s.normal.z,
                           static_cast<double>(s.kind)}) {
      floats.push_back(static_cast<float>(v));
    }
  }
  return arrayOf("Float32Array", floats);
}

EMSCRIPTEN_BINDINGS(spinaltap_core) {
  bindSession();
  bindHand();
  bindPlayer();
  emscripten::function("makeScene", &makeScene);
  emscripten::function("takeError", &takeError);
  emscripten::function("version", &version);
  emscripten::constant("splatRadiusPerSpacing", splats::kCoveringRadiusPerSpacing);
}

}  // namespace spinaltap::wasm
