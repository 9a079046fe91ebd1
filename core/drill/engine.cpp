#include "core/drill/engine.h"

#include <string>

#include "core/drill/cutter.h"

namespace spinaltap::drill {

Result<std::unique_ptr<Engine>> makeEngine(std::string_view name, const point_volume::PointVolume& volume,
                                           const plan::Bit& bit, const EngineOptions& options) {
  if (name == "clearance") {
    if (options.threads < 1 || options.threads > 2)
      return fail(ErrorCode::Unsupported, "engine clearance: 1 or 2 threads");
    return makeClearance(volume.lattice, bit, options);
  }
  if (options.threads != 1) return fail(ErrorCode::Unsupported, "two threads: only by the engine clearance");
  if (name == "reference") return makeReference(volume.lattice, bit, options.precision);
  if (options.precision == Precision::Single) {
    return fail(ErrorCode::Unsupported, "single precision: only by the engines reference and clearance");
  }
  if (name == "report") return makeReport(volume.lattice, bit);
  if (name == "bounded") return makeBounded(volume.lattice, bit);
  return fail(ErrorCode::NotFound, "no engine '" + std::string(name.substr(0, 40)) +
                                       "': there are reference, report, bounded and clearance");
}

std::vector<std::string_view> engineNames() { return {"reference", "report", "bounded", "clearance"}; }

}  // namespace spinaltap::drill
