// core/rbf/summation.h - direct sums over all centres, eight points at a time (internal to rbf).
#pragma once
#include <span>
#include <vector>

#include "core/rbf/rbf.h"

namespace spinaltap::rbf {

/// A model laid out for the inner loop: one array a coordinate.
struct FlatModel {
  Vec3 centroid_patient;
  std::vector<double> x, y, z, weight;
  double constant = 0;
  Vec3 linear;

  FlatModel() = default;
  explicit FlatModel(const Model& model);
};

/// Every point's sum runs over the centres in their own order, so the bits depend neither on the number of threads nor
/// on the other points of the batch.
void sumValues(const FlatModel& model, std::span<const Vec3> points_patient, std::span<double> out);
void sumGradients(const FlatModel& model, std::span<const Vec3> points_patient, std::span<Vec3> out);

}  // namespace spinaltap::rbf
