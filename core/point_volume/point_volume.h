// core/point_volume/point_volume.h - which points of the lattice are bone, and how dense each is.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/base/field.h"
#include "core/base/frame.h"
#include "core/base/hash.h"
#include "core/point_volume/lattice.h"

namespace spinaltap::point_volume {

/// One alive bit and a density a point; nothing else is stored per point.
struct PointVolume {
  Lattice lattice;
  std::vector<std::uint64_t> alive;           ///< bit (index & 63) of word (index >> 6); bits past the end are 0
  std::vector<std::uint16_t> density_mg_cm3;  ///< #points; apparent density, 0 where no bone is

  [[nodiscard]] bool isAlive(std::uint32_t index) const { return (alive[index >> 6] >> (index & 63)) & 1u; }
  /// What the bits and densities take in memory: 2.125 bytes a point.
  [[nodiscard]] std::size_t bytes() const {
    return alive.capacity() * sizeof(alive[0]) + density_mg_cm3.capacity() * sizeof(density_mg_cm3[0]);
  }
};

/// Apparent density of bone from HU: 47 + 1.122 HU kg/m3 (= mg/cm3), the lumbar relation of Rho, Hobatho and Ashman,
/// Med. Eng. Phys. 17 (1995), clamped to 0 .. 65535.
[[nodiscard]] std::uint16_t densityFromHu(double hu);

/// All points alive, one density: the bare volume of scenes and benchmarks.
/// @error as checkLattice.
[[nodiscard]] Result<PointVolume> solidVolume(const Lattice& lattice, std::uint16_t density_mg_cm3);

/// hu(points_patient, out): the CT's HU at each point. Safe to call from several threads.
using HuSampler = std::function<void(std::span<const Vec3>, std::span<double>)>;

/// Points inside the bone (field < 0) are alive with the CT's density. The field is evaluated only where its
/// Lipschitz bound cannot already decide, and exactly only where its error could; the result equals evaluating every
/// point exactly, and has the same bits from any number of threads.
/// @param threads 0: all. The field is asked from the caller's thread alone, many points at a time.
/// @error as checkLattice.
/// @cost  an evaluation for each point within some tenths of a millimetre of the surface, a sample of the CT for each
///        alive point. See tests/bench/bench_volume.cpp.
[[nodiscard]] Result<PointVolume> buildVolume(const Lattice& lattice, const Frame& path_frame, const Field& field,
                                              const HuSampler& hu, unsigned threads = 0);

[[nodiscard]] std::uint64_t countAlive(const PointVolume& volume);

/// Which points are alive, in 64 bits: the sum over all words modulo 2^64, so that a cycle pays for the words it
/// changes.
[[nodiscard]] constexpr std::uint64_t wordHash(std::uint32_t word, std::uint64_t alive) {
  return mix64(alive ^ (std::uint64_t{word} * 0x9e3779b97f4a7c15ULL));
}
[[nodiscard]] std::uint64_t aliveHash(const PointVolume& volume);

}  // namespace spinaltap::point_volume
