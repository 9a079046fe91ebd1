// Which points are bone. The cylinder is halved along its longest side, block by block, until the field's Lipschitz
// bound decides a whole block from its centre, or the block is so small that its points are evaluated one by one.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/dmath.h"
#include "core/base/parallel.h"
#include "core/point_volume/point_volume.h"

namespace spinaltap::point_volume {
namespace {

constexpr std::uint32_t kFewPoints = 24;  // below this, halving costs about what it saves
constexpr std::size_t kBatch = 65'536;    // points in one call of the field
constexpr std::uint32_t kSamples = 8192;  // indices that one thread samples at a time: whole words of alive bits
constexpr std::int64_t kTurn = 1 << 24;   // angles as integers, so that every slot falls in one block
constexpr double kSlack_mm = 1e-6;        // rounding in block centres, and in the field itself

/// Discs, rings and angles begin .. end-1.
struct Block {
  int disc_begin, disc_end, ring_begin, ring_end;
  std::int64_t turn_begin, turn_end;
};

/// The slots of a ring whose angle lies in the block.
int firstSlotFrom(std::int64_t turn, int ring) {
  return static_cast<int>((turn * Lattice::slotsOf(ring) + kTurn - 1) / kTurn);
}

class Builder {
 public:
  Builder(const Lattice& lattice, const Frame& frame, const Field& field, const HuSampler& hu, unsigned threads)
      : frame_(frame), field_(field), hu_(hu), threads_(threads), table_(discTable(lattice)) {
    volume_.lattice = lattice;
    volume_.alive.assign(static_cast<std::size_t>((lattice.points() + 63) / 64), 0);
    volume_.density_mg_cm3.assign(static_cast<std::size_t>(lattice.points()), 0);
  }

  PointVolume build() {
    const Lattice& l = volume_.lattice;
    const Block all{0, l.discs, 0, l.rings, 0, kTurn};
    const bool bounded = field_.lipschitz >= 0 && std::isfinite(field_.lipschitz);
    std::vector<Block> blocks{all}, next;
    if (!bounded) blocks.clear(), putPoints(all);
    while (!blocks.empty()) {
      next.clear();
      for (std::size_t i = 0; i < blocks.size(); i += kBatch) {
        decide({blocks.data() + i, std::min(kBatch, blocks.size() - i)}, next);
      }
      blocks.swap(next);
    }
    evaluatePending();
    sampleDensity();
    return std::move(volume_);
  }

 private:
  /// Calls visit(disc, first, last) with runs of point indices within a disc.
  template <class Visit>
  void forRuns(const Block& block, const Visit& visit) const {
    for (int disc = block.disc_begin; disc < block.disc_end; ++disc) {
      for (int ring = block.ring_begin; ring < block.ring_end; ++ring) {
        const std::uint32_t start = Lattice::ringStart(ring);
        const int first = firstSlotFrom(block.turn_begin, ring), end = firstSlotFrom(block.turn_end, ring);
        if (first < end)
          visit(disc, start + static_cast<std::uint32_t>(first), start + static_cast<std::uint32_t>(end));
      }
    }
  }

  [[nodiscard]] std::uint64_t countPoints(const Block& block) const {
    std::uint64_t count = 0;
    Block one = block;
    one.disc_end = block.disc_begin + 1;
    forRuns(one, [&](int, std::uint32_t first, std::uint32_t end) { count += end - first; });
    return count * static_cast<std::uint64_t>(block.disc_end - block.disc_begin);
  }

  struct Ball {
    Vec3 centre;  // path frame
    double radius_mm;
    double along_mm, across_mm, around_mm;  // the block's sides
  };

  /// In polar coordinates the farthest point of a block from its middle is one of two corners: at a fixed angle the
  /// distance is convex in the radius, at a fixed radius it grows with the angle.
  [[nodiscard]] Ball ballOf(const Block& block) const {
    const Lattice& l = volume_.lattice;
    const double r0 = block.ring_begin * l.spacing_mm, r1 = (block.ring_end - 1) * l.spacing_mm;
    const double half_rad = kPi * static_cast<double>(block.turn_end - block.turn_begin) / static_cast<double>(kTurn);
    const double middle_rad = kPi * static_cast<double>(block.turn_begin + block.turn_end) / static_cast<double>(kTurn);
    const double z0 = l.discZ_mm(block.disc_begin), z1 = l.discZ_mm(block.disc_end - 1);
    const double r = half_rad >= kPi ? 0.0 : 0.5 * (r0 + r1), cosine = sinCos(half_rad).cos;
    const auto corner = [&](double ring) { return std::max(0.0, ring * ring + r * r - 2 * r * ring * cosine); };
    const double flat = std::max(corner(r0), corner(r1)), half_z = 0.5 * (z1 - z0);
    const SinCos middle = sinCos(middle_rad);
    return {{r * middle.cos, r * middle.sin, 0.5 * (z0 + z1)},
            std::sqrt(flat + half_z * half_z),
            z1 - z0,
            r1 - r0,
            2 * half_rad * r1};
  }

  void decide(std::span<const Block> blocks, std::vector<Block>& next) {
    std::vector<Ball> balls;
    std::vector<Vec3> centres;
    for (const Block& block : blocks) {
      balls.push_back(ballOf(block));
      centres.push_back(frame_.toPatient(balls.back().centre));
    }
    std::vector<double> values(centres.size(), std::numeric_limits<double>::quiet_NaN());
    field_.values(centres, values);
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const double reach = field_.lipschitz * (balls[i].radius_mm + kSlack_mm) + kSlack_mm + field_.error_mm;
      if (values[i] > reach) continue;  // no bone
      if (values[i] < -reach) {
        fillAlive(blocks[i]);
      } else if (countPoints(blocks[i]) <= kFewPoints) {
        putPoints(blocks[i]);
      } else {
        halve(blocks[i], balls[i], next);
      }
    }
  }

  static void halve(const Block& block, const Ball& ball, std::vector<Block>& next) {
    Block a = block, b = block;
    const bool discs = block.disc_end - block.disc_begin > 1, rings = block.ring_end - block.ring_begin > 1;
    if (discs && (ball.along_mm >= std::max(ball.across_mm, ball.around_mm))) {
      a.disc_end = b.disc_begin = (block.disc_begin + block.disc_end) / 2;
    } else if (rings && ball.across_mm >= ball.around_mm) {
      a.ring_end = b.ring_begin = (block.ring_begin + block.ring_end) / 2;
    } else {
      a.turn_end = b.turn_begin = (block.turn_begin + block.turn_end) / 2;
    }
    next.push_back(a), next.push_back(b);
  }

  void setAlive(std::uint32_t index) { volume_.alive[index >> 6] |= std::uint64_t{1} << (index & 63); }

  /// @pre first < end.
  void setAlive(std::uint32_t first, std::uint32_t end) {
    const std::uint32_t last = end - 1;
    const std::uint64_t from = ~std::uint64_t{0} << (first & 63), to = ~std::uint64_t{0} >> (63 - (last & 63));
    if (first >> 6 == last >> 6) {
      volume_.alive[first >> 6] |= from & to;
      return;
    }
    volume_.alive[first >> 6] |= from;
    for (std::uint32_t word = (first >> 6) + 1; word < last >> 6; ++word) volume_.alive[word] = ~std::uint64_t{0};
    volume_.alive[last >> 6] |= to;
  }

  void fillAlive(const Block& block) {
    const std::uint32_t per_disc = volume_.lattice.pointsPerDisc();
    forRuns(block, [&](int disc, std::uint32_t first, std::uint32_t end) {
      const std::uint32_t start = static_cast<std::uint32_t>(disc) * per_disc;
      setAlive(start + first, start + end);
    });
  }

  void putPoints(const Block& block) {
    const std::uint32_t per_disc = volume_.lattice.pointsPerDisc();
    forRuns(block, [&](int disc, std::uint32_t first, std::uint32_t end) {
      for (std::uint32_t i = first; i < end; ++i) {
        pending_.push_back(static_cast<std::uint32_t>(disc) * per_disc + i);
        if (pending_.size() == kBatch) evaluatePending();
      }
    });
  }

  [[nodiscard]] Vec3 positionOf(std::uint32_t index) const {
    const std::uint32_t per_disc = volume_.lattice.pointsPerDisc(), rest = index % per_disc;
    return frame_.toPatient(
        {table_.x_mm[rest], table_.y_mm[rest], volume_.lattice.discZ_mm(static_cast<int>(index / per_disc))});
  }

  void locatePending() {
    points_.clear();
    for (const std::uint32_t index : pending_) points_.push_back(positionOf(index));
    values_.assign(points_.size(), std::numeric_limits<double>::quiet_NaN());
  }

  void evaluatePending() {
    if (pending_.empty()) return;
    locatePending();
    field_.values(points_, values_);
    if (field_.exact) makeExact();
    for (std::size_t i = 0; i < pending_.size(); ++i) {
      if (values_[i] < 0) setAlive(pending_[i]);
    }
    pending_.clear();
  }

  /// Values whose sign the field's error could turn are asked again.
  void makeExact() {
    std::vector<std::size_t> unsure;
    std::vector<Vec3> at;
    for (std::size_t i = 0; i < values_.size(); ++i) {
      if (!(std::abs(values_[i]) > field_.error_mm)) unsure.push_back(i), at.push_back(points_[i]);
    }
    if (at.empty()) return;
    std::vector<double> exact(at.size(), std::numeric_limits<double>::quiet_NaN());
    field_.exact(at, exact);
    for (std::size_t n = 0; n < unsure.size(); ++n) values_[unsure[n]] = exact[n];
  }

  void sampleDensity() {
    static_assert(kSamples % 64 == 0);
    parallelBlocks(volume_.density_mg_cm3.size(), kSamples, threads_, [&](std::size_t begin, std::size_t end) {
      std::vector<std::uint32_t> alive;
      for (auto i = static_cast<std::uint32_t>(begin); i < end; ++i) {
        if (volume_.isAlive(i)) alive.push_back(i);
      }
      if (alive.empty()) return;
      std::vector<Vec3> points;
      points.reserve(alive.size());
      for (const std::uint32_t index : alive) points.push_back(positionOf(index));
      std::vector<double> hu(alive.size(), std::numeric_limits<double>::quiet_NaN());
      hu_(points, hu);
      for (std::size_t n = 0; n < alive.size(); ++n) volume_.density_mg_cm3[alive[n]] = densityFromHu(hu[n]);
    });
  }

  const Frame& frame_;
  const Field& field_;
  const HuSampler& hu_;
  unsigned threads_;
  DiscTable table_;
  PointVolume volume_;
  std::vector<std::uint32_t> pending_;
  std::vector<Vec3> points_;
  std::vector<double> values_;
};

}  // namespace

Result<PointVolume> buildVolume(const Lattice& lattice, const Frame& path_frame, const Field& field,
                                const HuSampler& hu, unsigned threads) {
  if (auto ok = checkLattice(lattice); !ok) return tl::unexpected(ok.error());
  return Builder(lattice, path_frame, field, hu, threads).build();
}

}  // namespace spinaltap::point_volume
