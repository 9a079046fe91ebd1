#include "core/segment/ownership.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/segment/valley.h"

namespace spinaltap::segment {
namespace {

constexpr int kUnit = 10;                        // of cost: one step through bright bone
constexpr double kDark = 11, kValley = 30;       // what darkness and a valley add, in steps
constexpr double kValley_hu = 120;               // HU per mm^2: a joint space a voxel wide between cortices
constexpr std::uint32_t kFarthest = 80 * kUnit;  // an L3's farthest tip lies some 50 mm from its seeds
constexpr double kSeedDepth_mm = 2;
constexpr double kSpan = 2.6;  // half the span of the transverse processes is at most this many half widths of the body
// From pedicle to facet it is shorter than from lamina to facet by about this. Where a joint space cannot be seen at
// all two floods meet midway, so the pedicles set out later.
constexpr std::uint16_t kPedicleStart = 14 * kUnit;
// A flood from the pedicle is at the transverse process's root about then: so seeds there hold the process itself, yet
// no joint is reached sooner than without them.
constexpr std::uint16_t kProcessStart = kPedicleStart + 26 * kUnit;
// Joints lie the farther apart the lower they are (the last ones some 45 mm), so L5 comes late to those with the
// sacrum.
constexpr std::uint16_t kSacrumStart = 30 * kUnit;

std::vector<std::uint16_t> costs(const Scene& scene, const std::vector<float>& hu, double threshold_hu) {
  const std::vector<float> softer = blurred(scene.block, scene.block.hu, 0.8, scene.threads);
  const double least = 0.5 * threshold_hu;
  const std::vector<float> valley = valleyDepth(scene.block, softer, least, scene.threads);
  std::vector<std::uint16_t> cost(hu.size(), kWall);
  for (std::size_t v = 0; v < hu.size(); ++v) {
    if (scene.block.known[v] == 0 || hu[v] < least) continue;
    const double bright = std::clamp((hu[v] - 0.4 * threshold_hu) / (0.8 * threshold_hu), 0.0, 1.0);
    const double deep = std::min(1.0, valley[v] / kValley_hu);
    cost[v] =
        static_cast<std::uint16_t>(std::lround(kUnit * (1 + kDark * (1 - bright) * (1 - bright) + kValley * deep)));
  }
  return cost;
}

/// Pedicles leave the upper half of the body, thoracic and lumbar alike. @param canal, p  in the body's frame.
bool inPedicle(const Body& body, const Vec3& canal, const Vec3& p) {
  return std::abs(p.x - canal.x) < body.half_width_mm + 1 && p.y > body.back_mm - 3 && p.y < canal.y && p.z > 0 &&
         p.z < 0.4 * body.height_mm;
}

/// A place behind a body, in the body's own measures: aside of and behind the canal's middle in half widths, over the
/// body's middle in heights.
struct Behind {
  double aside, back, over;
};

/// The lamina where it roofs the canal, below the pedicles, in front of where the upper neighbour's processes hang.
bool isLamina(const Behind& p) { return p.over > -0.25 && p.over < -0.1 && p.aside < 0.4 && p.back < 0.45; }
/// Beside the pedicles nothing but the root of the transverse process and the pars: facets lie nearer to the midline.
bool isProcessRoot(const Behind& p) { return std::abs(p.over) < 0.2 && p.aside > 1 && p.aside < 1.8; }
/// In front of the joints behind the lower disc, and a body's height below: never the wanted one's.
bool isUnder(const Behind& p) { return p.over < -1.35 || (p.over < -0.75 && p.back < 0.05); }

class Seeds {
 public:
  Seeds(const Scene& scene, const std::vector<float>& hu, double threshold_hu, Flood& flood)
      : scene_(scene), hu_(hu), threshold_hu_(threshold_hu), flood_(flood) {}

  /// The column between the plates, and the pedicles where they are to be trusted. Of a likeness only what is bone.
  void sowBody(const Body& body, std::uint8_t owner, bool is_likeness, bool pedicles) {
    const Block& block = scene_.block;
    const Vec3 canal = body.canal ? body.frame.toLocal(*body.canal) : Vec3{};
    std::size_t v = 0;
    for (int k = 0; k < block.dims[2]; ++k) {
      for (int j = 0; j < block.dims[1]; ++j) {
        for (int i = 0; i < block.dims[0]; ++i, ++v) {
          const Vec3 p = body.frame.toLocal(block.place(i, j, k));
          if (std::abs(p.z) > body.height_mm || block.known[v] == 0) continue;
          const bool bone = hu_[v] > threshold_hu_;
          const bool column = (bone || !is_likeness) && depthIn(body, p).least() > kSeedDepth_mm;
          if (!column && !(pedicles && bone && body.canal && inPedicle(body, canal, p))) continue;
          sow(v, owner, kPedicleStart);
          if (column) flood_.cost[v] = kUnit;  // marrow may be dark
        }
      }
    }
  }

  /// What of the arch is sure to be the body's own.
  void sowArch(const Body& body, std::uint8_t owner) {
    eachBehind(body, [&](std::size_t v, const Behind& at) {
      if (isLamina(at)) sow(v, owner, 0);
      if (isProcessRoot(at)) sow(v, owner, kProcessStart);
    });
  }

  /// Where the lower neighbour was not found: the places that are sure not to be the wanted one's. @param wanted  its
  /// measures are used, for a likeness's pedicles and lamina may lie anywhere.
  void sowUnder(const Body& wanted, std::uint16_t start) {
    eachBehind(wanted, [&](std::size_t v, const Behind& at) {
      if (isUnder(at)) sow(v, kBelow, start);
    });
  }

  /// Bone too far to the side for a transverse process: ribs, ilium.
  void sowSides(const Body& body) {
    eachUnowned([&](std::size_t v, const Vec3& place) {
      if (std::abs(body.frame.toLocal(place).x) >= kSpan * body.half_width_mm) sow(v, kOther, 0);
    });
  }

  /// The first bone behind the canal, near the middle plane: the lamina lies there at the height of the body's lower
  /// half.
  void sowLamina(const Body& body, std::uint8_t owner) {
    if (!body.canal) return;
    const Vec3 canal = body.frame.toLocal(*body.canal);
    for (double z = -0.45 * body.height_mm; z <= -0.15 * body.height_mm; z += 0.5) {
      for (double x = -2; x <= 2; x += 0.5) sowBehind(body, {canal.x + x, canal.y, z}, owner);
    }
  }

 private:
  /// Calls use(voxel, place) for the bone that nobody owns.
  template <class Use>
  void eachUnowned(const Use& use) {
    const Block& block = scene_.block;
    std::size_t v = 0;
    for (int k = 0; k < block.dims[2]; ++k) {
      for (int j = 0; j < block.dims[1]; ++j) {
        for (int i = 0; i < block.dims[0]; ++i, ++v) {
          if (flood_.cost[v] == kWall || flood_.owner[v] != kNobody || hu_[v] < threshold_hu_) continue;
          use(v, block.place(i, j, k));
        }
      }
    }
  }

  /// Calls use(voxel, where) for the bone behind a body that nobody owns.
  template <class Use>
  void eachBehind(const Body& body, const Use& use) {
    if (!body.canal) return;
    const Vec3 canal = body.frame.toLocal(*body.canal);
    eachUnowned([&](std::size_t v, const Vec3& place) {
      const Vec3 p = body.frame.toLocal(place);
      if (p.y < body.back_mm + 2) return;
      use(v,
          {std::abs(p.x - canal.x) / body.half_width_mm, (p.y - canal.y) / body.half_width_mm, p.z / body.height_mm});
    });
  }

  void sow(std::size_t v, std::uint8_t owner, std::uint16_t start) { flood_.owner[v] = owner, flood_.start[v] = start; }

  void sowBehind(const Body& body, const Vec3& start, std::uint8_t owner) {
    constexpr double kReach_mm = 22, kThick_mm = 4;
    double bone_mm = 0;
    for (double y = 0; y < kReach_mm && bone_mm < kThick_mm; y += 0.5) {
      const Vec3 place = body.frame.toPatient({start.x, start.y + y, start.z});
      if (!isKnown(scene_.block, place)) return;
      if (valueAt(scene_.block, hu_, place) < threshold_hu_) {
        if (bone_mm > 0) return;
        continue;
      }
      bone_mm += 0.5;
      const Vec3 at = scene_.block.voxelAt(place);
      const std::size_t v = scene_.block.index(static_cast<int>(std::lround(at.x)), static_cast<int>(std::lround(at.y)),
                                               static_cast<int>(std::lround(at.z)));
      sow(v, owner, 0);
    }
  }

  const Scene& scene_;
  const std::vector<float>& hu_;
  double threshold_hu_;
  Flood& flood_;
};

/// Where two vertebrae meet at their facets some places are nearly always of one of them. The lower one's superior
/// processes end below 0.8 of its height; what lies before that behind the canal near the midline hangs down from the
/// upper one, and the farther back, the wider it is; what lies beside the pedicles is its own.
bool isUppersOverLower(const Behind& p) { return p.over > 0.8 || (p.over > 0.25 && p.back > 0.65 && p.aside < 0.5); }
bool isLowersOverLower(const Behind& p) { return p.over < 0.5 && p.aside > 0.85; }

/// The same as seen from the upper one: laminae and inferior processes hang behind its canal down to the next body's
/// middle.
bool isUppersUnderUpper(const Behind& p) { return p.over > -0.75 && p.over < -0.2 && p.back > 0.4 && p.aside < 0.7; }
bool isLowersUnderUpper(const Behind& p) {
  return p.over < -1.25 || (p.over < -0.4 && p.aside > 1.05) || (p.over < -0.5 && p.back < 0.1);
}

/// A worn joint may show no space at all: there places of one vertebra are dear to the other.
void marshalFacets(const Block& block, const Body& body, bool is_lower, std::uint8_t lower_owner,
                   std::uint8_t upper_owner, std::vector<std::uint8_t>& against) {
  if (!body.canal) return;
  const Vec3 canal = body.frame.toLocal(*body.canal);
  const double h = body.height_mm, half = body.half_width_mm;
  const auto lowers = is_lower ? isLowersOverLower : isLowersUnderUpper;
  const auto uppers = is_lower ? isUppersOverLower : isUppersUnderUpper;
  std::size_t v = 0;
  for (int k = 0; k < block.dims[2]; ++k) {
    for (int j = 0; j < block.dims[1]; ++j) {
      for (int i = 0; i < block.dims[0]; ++i, ++v) {
        const Vec3 p = body.frame.toLocal(block.place(i, j, k));
        if (p.y < body.back_mm + 2 || (is_lower ? p.z < 0 || p.z > 1.5 * h : p.z > 0 || p.z < -1.7 * h)) continue;
        const Behind at{std::abs(p.x - canal.x) / half, (p.y - canal.y) / half, p.z / h};
        if (uppers(at)) against[v] |= static_cast<std::uint8_t>(1U << lower_owner);
        if (lowers(at)) against[v] |= static_cast<std::uint8_t>(1U << upper_owner);
      }
    }
  }
}

/// Beside the body of a sacrum there is bone, its alae; beside a lumbar body that the scan cuts off there is muscle.
/// @param likeness  where the body should be.
bool isSacrum(const Scene& scene, const Body& likeness, double threshold_hu) {
  constexpr double kAside = 1.5;      // of half the body's width: farther than any spur, nearer than the ilium
  constexpr double kLeastPart = 0.2;  // transverse processes and spurs fill a tenth at most, alae a third and more
  int places = 0, bone = 0;
  for (int z = -2; z <= 5; ++z) {
    for (int y = -2; y <= 10; ++y) {
      for (const double side : {-kAside, kAside}) {
        const Vec3 p = likeness.frame.toPatient(
            {side * likeness.half_width_mm, 0.1 * y * likeness.back_mm, 0.1 * z * likeness.height_mm});
        if (!isKnown(scene.block, p)) continue;
        ++places;
        bone += valueAt(scene.block, scene.smooth, p) > threshold_hu ? 1 : 0;
      }
    }
  }
  return bone > kLeastPart * places;
}

/// Gives owners to voxels near owned ones that the flood did not enter, so that the edge can be drawn anywhere.
void spread(const Block& block, std::vector<std::uint8_t>& owner) {
  constexpr std::uint32_t kSteps = 3;
  owner = compete({block.dims, std::vector<std::uint16_t>(owner.size(), kUnit), owner}, kSteps * kUnit).owner;
}

}  // namespace

Ownership shareBone(const Scene& scene, const Spine& spine, double threshold_hu) {
  const std::vector<float> hu = blurred(scene.block, scene.block.hu, 0.4, scene.threads);
  const std::size_t voxels = hu.size();
  Flood flood{scene.block.dims, costs(scene, hu, threshold_hu), std::vector<std::uint8_t>(voxels, kNobody),
              std::vector<std::uint16_t>(voxels, 0), std::vector<std::uint8_t>(voxels, 0)};
  marshalFacets(scene.block, spine.wanted, true, kWanted, kAbove, flood.against);
  if (spine.below.found) {
    marshalFacets(scene.block, spine.below.body, true, kBelow, kWanted, flood.against);
  } else {  // a sacrum, or the end of the scan: a likeness says less of the joint than the wanted one itself
    marshalFacets(scene.block, spine.wanted, false, kBelow, kWanted, flood.against);
  }
  Seeds seeds(scene, hu, threshold_hu, flood);
  seeds.sowBody(spine.wanted, kWanted, false, true);
  seeds.sowBody(spine.above.body, kAbove, !spine.above.found, true);
  seeds.sowBody(spine.below.body, kBelow, !spine.below.found, spine.below.found);
  seeds.sowArch(spine.wanted, kWanted);
  if (spine.above.found) seeds.sowArch(spine.above.body, kAbove);
  seeds.sowLamina(spine.wanted, kWanted);
  seeds.sowLamina(spine.above.body, kAbove);
  if (spine.below.found) {
    seeds.sowArch(spine.below.body, kBelow);
    seeds.sowLamina(spine.below.body, kBelow);
  } else {
    seeds.sowUnder(spine.wanted, isSacrum(scene, spine.below.body, threshold_hu) ? kSacrumStart : std::uint16_t{0});
  }
  seeds.sowSides(spine.wanted);
  Ownership out{compete(flood, kFarthest).owner};
  spread(scene.block, out.owner);
  return out;
}

}  // namespace spinaltap::segment
