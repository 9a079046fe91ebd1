#include "core/segment/isolate.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/parallel.h"
#include "core/segment/edge.h"
#include "core/segment/neighbours.h"
#include "core/segment/ownership.h"
#include "core/volume/sample.h"

namespace spinaltap::segment {
namespace {

using volume::CtVolume;

constexpr double kStep_mm = 1;
constexpr Vec3 kBlockLow_mm{-62, -48, -78},
    kBlockHigh_mm{62, 92, 78};  // one lumbar vertebra and half of each neighbour
constexpr double kThinnest_mm = 20;
// The shell is seen through partial volume: half-way measured on its weakest walls would fall into the noise of soft
// tissue, on its strongest would take thin shells away.
constexpr double kLeastThreshold_hu = 130, kMostThreshold_hu = 145;

std::string whole(double value) { return std::to_string(static_cast<long>(std::lround(value))); }

Result<void> checkInput(const CtVolume& ct, const IsolateOptions& o) {
  if (auto ok = volume::checkGrid(ct.grid); !ok) return ok;
  if (ct.hu.size() != ct.grid.voxels()) return fail(ErrorCode::InvalidArgument, "volume has not one value a voxel");
  if (!isFinite(o.seed_patient) || !std::isfinite(o.threshold_hu)) {
    return fail(ErrorCode::NotFinite, "segmentation seed or threshold is not finite");
  }
  if (o.threshold_hu < 0 || o.threshold_hu > 3000) {
    return fail(ErrorCode::InvalidArgument, "segmentation threshold is not between 0 and 3000 HU");
  }
  const Vec3 v = ct.grid.toVoxel(o.seed_patient), s = ct.grid.spacing_mm;
  const double at[3] = {v.x, v.y, v.z}, spacing[3] = {s.x, s.y, s.z};
  for (std::size_t a = 0; a < 3; ++a) {
    if (at[a] < -0.5 || at[a] > ct.grid.dims[a] - 0.5) {
      return fail(ErrorCode::InvalidArgument, "the seed lies outside the volume");
    }
    if (ct.grid.dims[a] * spacing[a] < kThinnest_mm) {
      return fail(ErrorCode::Degenerate, "the volume is only " + whole(ct.grid.dims[a] * spacing[a]) +
                                             " mm thick along one axis: a vertebra cannot be told from so little");
    }
  }
  return {};
}

tl::unexpected<Error> noBody(const CtVolume& ct, const Vec3& seed) {
  return fail(ErrorCode::NotFound, "no vertebral body at the seed (" + whole(volume::sampleHu(ct, seed)) +
                                       " HU there): click near the middle of a body");
}

}  // namespace

Result<Isolated> isolate(const CtVolume& ct, const IsolateOptions& options, const IsolateProgress& progress) {
  if (auto ok = checkInput(ct, options); !ok) return tl::unexpected(ok.error());
  const auto tell = [&](std::string_view stage, double done) {
    if (progress) progress(stage, done);
  };
  const Vec3& seed = options.seed_patient;
  const unsigned threads = threadsOr(options.threads);
  tell("body", 0);
  Scene scene{blockAround(ct, seed, kBlockLow_mm, kBlockHigh_mm, kStep_mm, threads), {}, threads};
  scene.smooth = blurred(scene.block, scene.block.hu, 1.0, threads);
  const auto body = findBody(scene, {}, {0, 0, 1});
  if (!body || depthIn(*body, body->frame.toLocal({})).least() < -4) return noBody(ct, seed);

  tell("neighbours", 0.3);
  const Spine spine{*body, findNeighbour(scene, *body, 1), findNeighbour(scene, *body, -1)};
  tell("compete", 0.7);
  const double measured = std::clamp(0.5 * (body->soft_hu + body->wall_hu), kLeastThreshold_hu, kMostThreshold_hu);
  const double threshold = options.threshold_hu > 0 ? options.threshold_hu : measured;
  const Ownership ownership = shareBone(scene, spine, threshold);
  tell("edge", 0.85);
  Isolated out;
  out.label = drawEdge({ct, seed, scene, spine, ownership, threshold});
  if (std::find(out.label.inside.begin(), out.label.inside.end(), 1) == out.label.inside.end()) return noBody(ct, seed);
  out.threshold_hu = threshold;
  out.body_middle_patient = seed + body->frame.origin_patient;
  out.body_up_patient = body->frame.axes.col_z;
  out.body_height_mm = body->height_mm;
  for (const Rival* rival : {&spine.above, &spine.below}) {
    if (rival->found) out.neighbours.push_back({seed + rival->body.frame.origin_patient, rival == &spine.above});
  }
  tell("edge", 1);
  return out;
}

}  // namespace spinaltap::segment
