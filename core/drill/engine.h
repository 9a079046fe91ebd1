// core/drill/engine.h - exact removal of points by the bit, one pose a cycle.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/function_ref.h"
#include "core/base/result.h"
#include "core/base/vec3.h"
#include "core/plan/path.h"
#include "core/point_volume/point_volume.h"

namespace spinaltap::drill {

/// Where the bit is, in the path frame.
struct BitPose {
  Vec3 tip_mm;         ///< the apex of the cone
  Vec3 axis{0, 0, 1};  ///< unit vector from the shank to the tip: the direction of drilling, +z on the path
};

/// What one step removed.
struct Removal {
  std::uint64_t count = 0;
  std::uint64_t density_sum_mg_cm3 = 0;  ///< exact, order-independent
  std::uint64_t hash_delta = 0;          ///< change of aliveHash (point_volume.h), modulo 2^64
  std::uint64_t tested = 0;              ///< points put to the predicate

  Removal& operator+=(const Removal& other) {
    count += other.count, density_sum_mg_cm3 += other.density_sum_mg_cm3;
    hash_delta += other.hash_delta, tested += other.tested;
    return *this;
  }
};

/// Is handed the indices of removed points, each once, in no order, a few at a time: a step that removes the whole bit
/// needs no more memory than one that removes a point.
using RemovedSink = FunctionRef<void(std::span<const std::uint32_t>)>;

/// The removal contract. After step(), every alive point of `volume` that the predicate (predicate.h) puts inside
/// the bit at `pose` is removed, and no other is touched. (`report` breaks the first half, as published.)
/// step() does not allocate, lock, throw or call libm; the same inputs give the same bits on every target.
class Engine {
 public:
  virtual ~Engine() = default;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  [[nodiscard]] virtual std::string_view name() const = 0;
  /// @pre `volume` is the one the engine was made for, and no point of it has come alive since; pose is finite, its
  ///      axis a unit vector to 1e-9.
  virtual Removal step(point_volume::PointVolume& volume, const BitPose& pose, RemovedSink removed) = 0;
  Removal step(point_volume::PointVolume& volume, const BitPose& pose) {
    return step(volume, pose, [](std::span<const std::uint32_t>) {});
  }
  /// What the engine holds besides the volume, its own tables included.
  [[nodiscard]] virtual std::size_t bytes() const = 0;

 protected:
  Engine() = default;
};

/// The predicate's arithmetic. Single is there to be compared with (predicate.h has its error): the same bits on every
/// target as well, but not those of Double, and a ring exactly as wide as the bit may be torn.
enum class Precision : std::uint8_t { Double, Single };

struct EngineOptions {
  Precision precision = Precision::Double;
  /// 2: a second thread takes half of the discs, and stays awake (it spins) while steps come fast. The same set, sums
  /// and hashes; the sink is called from either thread, never from both at a time.
  int threads = 1;
};

/// `reference`: every alive point, every cycle; the truth for all others.
/// `report`:    the 2002 algorithm as published; the rival in benchmarks.
/// `bounded`:   as reference, but only on the discs, rings and slots that the bit can reach.
/// `clearance`: as bounded, but only where the bit can have come nearer to bone than was known; what the program uses.
/// @error NotFound, naming the engines there are; Unsupported: single precision but for `reference` and `clearance`,
///        two threads but for `clearance`, more than two.
[[nodiscard]] Result<std::unique_ptr<Engine>> makeEngine(std::string_view name, const point_volume::PointVolume& volume,
                                                         const plan::Bit& bit, const EngineOptions& options = {});

[[nodiscard]] std::vector<std::string_view> engineNames();

}  // namespace spinaltap::drill
