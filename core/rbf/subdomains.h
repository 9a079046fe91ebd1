// core/rbf/subdomains.h - points cut into boxes, each with the points around it (internal).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/vec3.h"

namespace spinaltap::rbf {

/// Indices of points: the first `inner` belong to this box alone, the others surround it.
struct Subdomain {
  std::vector<std::uint32_t> points;
  std::size_t inner = 0;
};

/// Halves the set at its longest side's median until no box has more than `inner` points; then each box takes the
/// points nearest to it until it has `whole`. Every point is inner to exactly one.
/// @pre 0 < inner <= whole. @cost O(#points log #points).
[[nodiscard]] std::vector<Subdomain> cutIntoSubdomains(std::span<const Vec3> points, std::size_t inner,
                                                       std::size_t whole);

/// At most `most` of those boxes, evenly chosen.
[[nodiscard]] std::vector<Subdomain> someSubdomains(std::span<const Vec3> points, std::size_t inner, std::size_t whole,
                                                    std::size_t most);

/// About one in `share` of each box's own points, as far from each other as can be: an even thinning of the set.
/// Indices in ascending order.
[[nodiscard]] std::vector<std::uint32_t> thinOut(std::span<const Vec3> points, const std::vector<Subdomain>& boxes,
                                                 double share);

}  // namespace spinaltap::rbf
