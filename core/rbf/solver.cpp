#include "core/rbf/solver.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <string>

namespace spinaltap::rbf {
namespace {

using Eigen::Index;
using Eigen::Lower;
using Eigen::MatrixXd;

}  // namespace

GrowingSolver::GrowingSolver(double span_mm, double ridge_mm, std::size_t max_centres)
    : span_mm_(span_mm), ridge_mm_(ridge_mm) {
  const auto n = static_cast<Index>(max_centres);
  factor_.resize(n, n);
  polynomial_.resize(n, 4);
  centres_.reserve(max_centres);
}

Result<void> GrowingSolver::add(std::span<const Vec3> positions) {
  const auto old = static_cast<Index>(centres_.size());
  const auto more = static_cast<Index>(positions.size());
  if (old + more > factor_.rows()) return fail(ErrorCode::InvalidArgument, "more centres than were announced");
  const double shift = 1.1 * span_mm_;
  const auto kernel = [shift](const Vec3& a, const Vec3& b) { return shift - norm(a - b); };

  // [L 0; B M] [L 0; B M]^T = [A  K^T; K  C]  gives  B = K L^-T  and  M M^T = C - B B^T.
  auto below = factor_.block(old, 0, more, old);
  for (Index j = 0; j < old; ++j) {
    for (Index i = 0; i < more; ++i) {
      below(i, j) = kernel(positions[static_cast<std::size_t>(i)], centres_[static_cast<std::size_t>(j)]);
    }
  }
  const auto leading = factor_.topLeftCorner(old, old).triangularView<Lower>();
  if (old > 0) leading.transpose().solveInPlace<Eigen::OnTheRight>(below);

  MatrixXd corner(more, more);
  for (Index j = 0; j < more; ++j) {
    for (Index i = j; i < more; ++i) {
      corner(i, j) = kernel(positions[static_cast<std::size_t>(i)], positions[static_cast<std::size_t>(j)]);
    }
    corner(j, j) += ridge_mm_;
  }
  if (old > 0) corner.selfadjointView<Lower>().rankUpdate(below, -1.0);
  const Eigen::LLT<Eigen::Ref<MatrixXd>> llt(corner);
  if (llt.info() != Eigen::Success) {
    return fail(ErrorCode::Degenerate, "kernel matrix of " + std::to_string(old + more) +
                                           " centres is not positive definite: samples too close to each other");
  }
  factor_.block(old, old, more, more).triangularView<Lower>() = corner.triangularView<Lower>();

  auto rows = polynomial_.middleRows(old, more);
  for (Index i = 0; i < more; ++i) {
    const Vec3 p = positions[static_cast<std::size_t>(i)] / span_mm_;
    rows.row(i) << 1.0, p.x, p.y, p.z;
  }
  if (old > 0) rows.noalias() -= below * polynomial_.topRows(old);
  factor_.block(old, old, more, more).triangularView<Lower>().solveInPlace(rows);
  centres_.insert(centres_.end(), positions.begin(), positions.end());
  return {};
}

Result<GrowingSolver::Solution> GrowingSolver::solve(const std::vector<double>& values) const {
  const auto n = static_cast<Index>(centres_.size());
  const auto lower = factor_.topLeftCorner(n, n).triangularView<Lower>();
  Eigen::VectorXd right = Eigen::Map<const Eigen::VectorXd>(values.data(), n);
  lower.solveInPlace(right);
  const MatrixXd p = polynomial_.topRows(n);
  const Eigen::ColPivHouseholderQR<MatrixXd> qr(p);
  if (qr.rank() < 4) return fail(ErrorCode::Degenerate, "centres lie in one plane");
  const Eigen::Vector4d c = qr.solve(right);
  right.noalias() -= p * c;
  lower.transpose().solveInPlace(right);
  Solution out;
  out.constant = c(0);
  out.linear = Vec3{c(1), c(2), c(3)} / span_mm_;
  out.weights.resize(centres_.size());
  for (Index i = 0; i < n; ++i) out.weights[static_cast<std::size_t>(i)] = -right(i);
  return out;
}

}  // namespace spinaltap::rbf
