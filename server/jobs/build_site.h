// server/jobs/build_site.h - a place to build point volumes at, so that building can be timed without a case: the
// phantom's left pedicle, its surface an RBF as the program fits it.
#pragma once
#include "core/base/frame.h"
#include "core/phantom/phantom.h"
#include "core/point_volume/lattice.h"
#include "core/rbf/rbf.h"
#include "core/volume/grid.h"

namespace spinaltap::jobs {

class BuildSite {
 public:
  /// @param samples that are fitted, about. @error those of rbf::fit and phantom::sampleCt.
  /// @cost some seconds, most of them the fit.
  [[nodiscard]] static Result<BuildSite> make(std::size_t samples = 12'000);

  /// Seconds to build a volume on this lattice along the pedicle, the fastest of `repeats`; the field's sums and bound
  /// (sumsOver) are made before and not counted.
  [[nodiscard]] Result<double> build_s(const point_volume::Lattice& lattice, int threads, int repeats) const;

  /// Makes the field's fast sums, and proves how steep it is around this lattice: once a path, whatever the spacing.
  /// @return seconds.
  double sumsOver(const point_volume::Lattice& lattice);

  [[nodiscard]] std::size_t centres() const { return model_.centres.size(); }

 private:
  Frame frame_;
  volume::CtVolume ct_;
  rbf::Model model_;
  double lipschitz_ = 0;
};

}  // namespace spinaltap::jobs
