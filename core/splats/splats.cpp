#include "core/splats/splats.h"

#include <cassert>
#include <cmath>

#include "core/splats/normals.h"

namespace spinaltap::splats {
namespace {

using point_volume::Lattice;
using point_volume::PointVolume;

bool testBit(const std::vector<std::uint64_t>& words, std::uint32_t index) {
  return (words[index >> 6] >> (index & 63)) & 1u;
}
void setBit(std::vector<std::uint64_t>& words, std::uint32_t index) { words[index >> 6] |= 1ull << (index & 63); }
void clearBit(std::vector<std::uint64_t>& words, std::uint32_t index) { words[index >> 6] &= ~(1ull << (index & 63)); }

/// Slot `offset` of sector `sector` (a sixth of the ring, k slots) on ring k, wrapped; offset may be -1 or k.
std::uint32_t inDisc(int ring, int sector, int offset) {
  if (ring == 0) return 0;
  const int slots = Lattice::slotsOf(ring);
  return Lattice::ringStart(ring) + static_cast<std::uint32_t>((sector * ring + offset + slots) % slots);
}

/// The neighbours of a point on its own disc, rings beyond the last included.
std::vector<std::uint32_t> flatNeighbours(int ring, int slot) {
  if (ring == 0) return {1, 2, 3, 4, 5, 6};
  const int sector = slot / ring, offset = slot % ring;
  std::vector<std::uint32_t> found = {inDisc(ring, sector, offset - 1), inDisc(ring, sector, offset + 1),
                                      inDisc(ring - 1, sector, offset), inDisc(ring + 1, sector, offset),
                                      inDisc(ring + 1, sector, offset + 1)};
  found.push_back(offset == 0 ? inDisc(ring + 1, sector, -1) : inDisc(ring - 1, sector, offset - 1));
  return found;
}

Splat splatAt(std::uint32_t index, const Vec3& position_mm, const Vec3& normal, Kind kind) {
  return {index, position_mm, normal, kind};
}

bool usable(const Vec3& v) { return isFinite(v) && norm(v) > 1e-12; }

/// Normals of the outer surface from the callback; those that it cannot give stay as they are.
void setOuterNormals(std::vector<Splat>& splats, const OuterNormals& outer_normals) {
  std::vector<std::size_t> which;
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < splats.size(); ++i) {
    if (splats[i].kind != Kind::OuterSurface) continue;
    which.push_back(i);
    points.push_back(splats[i].position_mm);
  }
  std::vector<Vec3> normals(points.size());
  outer_normals(points, normals);
  for (std::size_t i = 0; i < which.size(); ++i) {
    if (usable(normals[i])) splats[which[i]].normal = normalized(normals[i]);
  }
}

}  // namespace

Neighbours::Neighbours(const Lattice& lattice)
    : per_disc_(lattice.pointsPerDisc()), discs_(static_cast<std::uint32_t>(lattice.discs)) {
  starts_.reserve(per_disc_ + 1);
  starts_.push_back(0);
  for (int ring = 0; ring < lattice.rings; ++ring) {
    for (int slot = 0; slot < Lattice::slotsOf(ring); ++slot) {
      for (const std::uint32_t other : flatNeighbours(ring, slot)) {
        if (other < per_disc_) flat_.push_back(other);
      }
      starts_.push_back(static_cast<std::uint32_t>(flat_.size()));
    }
  }
}

bool isExposed(const PointVolume& volume, const Neighbours& neighbours, std::uint32_t index) {
  if (!volume.isAlive(index)) return false;
  bool exposed = false;
  neighbours.forEach(index, [&](std::uint32_t other) { exposed = exposed || !volume.isAlive(other); });
  return exposed;
}

Vec3 cutNormal(const Cut& cut, const Vec3& point_mm) {
  const Vec3 from_tip = point_mm - cut.tip_mm;
  const double along = -dot(from_tip, cut.axis);
  const Vec3 radial = from_tip + cut.axis * along;
  const double distance = norm(radial);
  const bool beside_cylinder = along >= cut.cone_length_mm;
  if (distance < 1e-9 || (!beside_cylinder && along <= 0 && cut.cone_length_mm <= 0)) return -cut.axis;
  const Vec3 outward = radial / distance;
  if (beside_cylinder) return -outward;
  // The cone's slant runs along radius * outward - length * axis; this is at right angles to it, into the hole.
  return -normalized(outward * cut.cone_length_mm + cut.axis * cut.radius_mm);
}

std::vector<Splat> scan(const PointVolume& volume, const PointVolume& before, const OuterNormals& outer_normals) {
  assert(volume.lattice == before.lattice);
  const Neighbours neighbours(volume.lattice);
  const point_volume::DiscTable disc = point_volume::discTable(volume.lattice);
  std::vector<Splat> splats;
  for (std::size_t word = 0; word < volume.alive.size(); ++word) {
    const std::uint64_t bits = volume.alive[word];
    for (std::uint32_t bit = 0; bit < 64 && bits >> bit != 0; ++bit) {
      const std::uint32_t index = static_cast<std::uint32_t>(64 * word) + bit;
      if (!isExposed(volume, neighbours, index)) continue;
      const Kind kind = isExposed(before, neighbours, index) ? Kind::OuterSurface : Kind::CutWall;
      splats.push_back(splatAt(index, positionOf(volume.lattice, disc, index), {}, kind));
    }
  }
  for (Splat& splat : splats) {
    splat.normal = estimateNormal(splat.kind == Kind::OuterSurface ? before : volume, disc, splat.index);
  }
  if (outer_normals) setOuterNormals(splats, outer_normals);
  return splats;
}

SplatTracker::SplatTracker(const PointVolume& volume, const OuterNormals& outer_normals)
    : neighbours_(volume.lattice),
      lattice_(volume.lattice),
      disc_(point_volume::discTable(volume.lattice)),
      queued_(volume.alive.size()),
      drawn_(volume.alive.size()),
      waiting_(scan(volume, volume, outer_normals)) {
  for (const Splat& splat : waiting_) setBit(queued_, splat.index);
}

void SplatTracker::update(const PointVolume& volume, std::span<const std::uint32_t> removed, const Cut& cut) {
  for (const std::uint32_t index : removed) {
    assert(!volume.isAlive(index));
    if (testBit(drawn_, index)) {
      clearBit(drawn_, index);
      hidden_.push_back(index);
    }
    neighbours_.forEach(index, [&](std::uint32_t other) {
      if (!volume.isAlive(other) || testBit(queued_, other)) return;
      setBit(queued_, other);
      const Vec3 position = positionOf(lattice_, disc_, other);
      waiting_.push_back(splatAt(other, position, cutNormal(cut, position), Kind::CutWall));
    });
  }
}

std::vector<Splat> SplatTracker::takeExposed(const PointVolume& volume) {
  std::vector<Splat> taken;
  taken.reserve(waiting_.size());
  for (const Splat& splat : waiting_) {
    if (!volume.isAlive(splat.index)) continue;  // came and went between two calls
    setBit(drawn_, splat.index);
    taken.push_back(splat);
  }
  waiting_.clear();
  return taken;
}

std::vector<std::uint32_t> SplatTracker::takeHidden() {
  std::vector<std::uint32_t> taken;
  taken.swap(hidden_);
  return taken;
}

}  // namespace spinaltap::splats
