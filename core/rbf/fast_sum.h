// core/rbf/fast_sum.h - sum_j w_j |t_i - s_j| for all targets at once, in time linear in sources and targets
// (internal). After: Fong and Darve, "The black-box fast multipole method", J. Comput. Phys. 228 (2009).
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "core/base/vec3.h"
#include "core/rbf/fast_sources.h"
#include "core/rbf/interactions.h"
#include "core/rbf/octree.h"

namespace spinaltap::rbf {

/// The geometry of one sum: trees, and which cubes see which. Weights come later, as often as wanted. The bits of the
/// result do not depend on the number of threads.
class FastSum {
 public:
  /// Positions may be far from the origin only as far as their digits allow; both sets are copied.
  /// @pre neither set is empty; everything finite.
  FastSum(std::span<const Vec3> sources, std::span<const Vec3> targets, const FastSumOptions& options);

  /// @pre the targets are within the sources' root.
  FastSum(const std::shared_ptr<const FastSources>& sources, std::span<const Vec3> targets,
          const FastSumOptions& options);

  /// out[i] = sum_j weights[j] |targets[i] - sources[j]|.
  void values(std::span<const double> weights, std::span<double> out) const { values(sources_->weigh(weights), out); }
  void values(const FastSources::Weighted& weighted, std::span<double> out) const;
  /// out[i] = sum_j weights[j] (targets[i] - sources[j]) / |targets[i] - sources[j]|, 0 / 0 counting as 0.
  void gradients(std::span<const double> weights, std::span<Vec3> out) const {
    gradients(sources_->weigh(weights), out);
  }
  void gradients(const FastSources::Weighted& weighted, std::span<Vec3> out) const;

 private:
  using Values = FastSources::Values;

  void meet(std::shared_ptr<const FastSources> sources, std::shared_ptr<const Octree> targets);
  [[nodiscard]] const FastSumOptions& options() const { return sources_->options(); }
  [[nodiscard]] Values passAcross(const FastSources::Weighted& weighted) const;
  void farGroup(std::size_t group, const Values& up, Values& down) const;
  template <class T>
  void farColumns(std::size_t from, std::size_t columns, const Values& up, Values& down, std::vector<T>& x,
                  std::vector<T>& y) const;
  void passDown(Values& down) const;
  /// What reaches the target leaves: near points, and nodes of small far cubes.
  template <class Use>
  void eachLeaf(const FastSources::Weighted& weighted, const Use& use) const;

  std::shared_ptr<const FastSources> sources_;
  std::shared_ptr<const Octree> targets_;
  Interactions seen_;
  FastSources::Offsets down_first_;
};

}  // namespace spinaltap::rbf
