#include "core/drill/engine.h"

#include <string>

#include "core/drill/cutter.h"

namespace spinaltap::drill {

Result<std::unique_ptr<Engine>> makeEngine(std::string_view name, const point_volume::PointVolume& volume,
                                           const plan::Bit& bit) {
  if (name == "reference") return makeReference(volume.lattice, bit);
  if (name == "report") return makeReport(volume.lattice, bit);
  if (name == "bounded") return makeBounded(volume.lattice, bit);
  if (name == "clearance") return makeClearance(volume.lattice, bit);
  return fail(ErrorCode::NotFound, "no engine '" + std::string(name.substr(0, 40)) +
                                       "': there are reference, report, bounded and clearance");
}

std::vector<std::string_view> engineNames() { return {"reference", "report", "bounded", "clearance"}; }

}  // namespace spinaltap::drill
