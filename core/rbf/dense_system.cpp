#include "core/rbf/dense_system.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/box.h"
#include "core/base/parallel.h"

namespace spinaltap::rbf {
namespace {

struct Ball {
  Vec3 middle;
  double radius = 1;
};

Ball ballOf(std::span<const Vec3> points) {
  const auto [low, high] = boxAround(points);
  Ball ball{(low + high) * 0.5, 0};
  for (const Vec3& p : points) ball.radius = std::max(ball.radius, norm(p - ball.middle));
  if (!(ball.radius > 0)) ball.radius = 1;
  return ball;
}

}  // namespace

template <class T>
DenseSystem<T>::DenseSystem(std::span<const Vec3> points, double ridge) : factor_(points.size()) {
  const Ball ball = ballOf(points);
  middle_ = ball.middle, scale_ = ball.radius;
  std::vector<T> at[3];
  for (std::vector<T>& axis : at) axis.assign(factor_.paddedSize(), T{0});
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 p = (points[i] - middle_) / scale_;
    at[0][i] = static_cast<T>(p.x), at[1][i] = static_cast<T>(p.y), at[2][i] = static_cast<T>(p.z);
  }
  factor_.fill({at[0].data(), at[1].data(), at[2].data(), points.size()}, static_cast<T>(2 + ridge / scale_));
}

template <class T>
std::unique_ptr<DenseSystem<T>> DenseSystem<T>::make(std::span<const Vec3> points, double ridge, unsigned threads) {
  std::unique_ptr<DenseSystem> made(new DenseSystem(points, ridge));
  if (!made->factor_.factor(threads)) return nullptr;
  made->reducePolynomials(points);
  return made;
}

template <class T>
void DenseSystem<T>::reducePolynomials(std::span<const Vec3> points) {
  const std::size_t n = points.size(), padded = factor_.paddedSize();
  polynomials_.assign(4 * padded, T{0});
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 p = (points[i] - middle_) / scale_;
    polynomials_[i] = 1;
    polynomials_[padded + i] = static_cast<T>(p.x);
    polynomials_[2 * padded + i] = static_cast<T>(p.y);
    polynomials_[3 * padded + i] = static_cast<T>(p.z);
  }
  for (std::size_t k = 0; k < 4; ++k) factor_.solveLower(polynomials_.data() + k * padded);
  Eigen::Matrix4d schur;
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < 4; ++b) {
      double sum = 0;
      for (std::size_t i = 0; i < n; ++i)
        sum += static_cast<double>(polynomials_[static_cast<std::size_t>(a) * padded + i]) *
               static_cast<double>(polynomials_[static_cast<std::size_t>(b) * padded + i]);
      schur(a, b) = sum;
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(schur);
  const double least = 1e3 * std::numeric_limits<T>::epsilon() * eigen.eigenvalues()(3);
  Eigen::Vector4d inverse;
  for (int k = 0; k < 4; ++k) inverse(k) = eigen.eigenvalues()(k) > least ? 1 / eigen.eigenvalues()(k) : 0;
  const Eigen::Matrix4d pseudo = eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < 4; ++b) inverse_[static_cast<std::size_t>(4 * a + b)] = pseudo(a, b);
}

template <class T>
Polynomial DenseSystem<T>::solve(std::span<const double> values, std::span<double> weights) const {
  const std::size_t n = values.size(), padded = factor_.paddedSize();
  std::vector<T> z(padded, T{0});
  for (std::size_t i = 0; i < n; ++i) z[i] = static_cast<T>(values[i]);
  factor_.solveLower(z.data());
  double moment[4], c[4];
  for (std::size_t k = 0; k < 4; ++k) {
    moment[k] = 0;
    for (std::size_t i = 0; i < n; ++i)
      moment[k] += static_cast<double>(polynomials_[k * padded + i]) * static_cast<double>(z[i]);
  }
  for (std::size_t a = 0; a < 4; ++a) {
    c[a] = 0;
    for (std::size_t b = 0; b < 4; ++b) c[a] += inverse_[4 * a + b] * moment[b];
  }
  for (std::size_t i = 0; i < n; ++i) {
    double sum = 0;
    for (std::size_t k = 0; k < 4; ++k) sum += c[k] * static_cast<double>(polynomials_[k * padded + i]);
    z[i] -= static_cast<T>(sum);
  }
  factor_.solveUpper(z.data());
  for (std::size_t i = 0; i < n; ++i) weights[i] = static_cast<double>(z[i]) / scale_;
  return {c[0] - (c[1] * middle_.x + c[2] * middle_.y + c[3] * middle_.z) / scale_, c[1] / scale_, c[2] / scale_,
          c[3] / scale_};
}

template class DenseSystem<float>;
template class DenseSystem<double>;

}  // namespace spinaltap::rbf
