#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "dense.hpp"
#include "derivatives.hpp"
#include "pipeline/laws.hpp"

namespace gradpsi {
namespace {

/// 1 - q of the neighbour nearest to point i: near the edge of the support, weights are what rounding leaves
/// of (1 - q)^n. 1 without neighbours.
double inside(const RandomCase& c, const Operator& op, int i) {
  double nearest = 1;
  for (SparseMatrix::InnerIterator entry(op.matrix(), i); entry; ++entry)
    if (entry.col() != i)
      nearest = std::min(
          nearest, c.displacement(i, static_cast<int>(entry.col()), op.rows.supports[i]).norm());
  return nearest < 1 ? 1 - nearest : 1;
}

}  // namespace

void expect_same(const RandomCase& c, const Operator& a, const Dense& expected, const Operator& b,
                 const Dense& found, double lost) {
  Worst worst;
  int outcomes = 0;
  for (int i = 0; i < c.size(); ++i) {
    const double rcond = reciprocal_condition(a, i);
    if (a.rows.degree[i] != b.rows.degree[i] ||
        std::abs(a.rows.supports[i] / b.rows.supports[i] - 1) > 1e-6) {
      const double least = std::min(a.rows.reciprocal_condition[i], b.rows.reciprocal_condition[i]);
      outcomes += least > 1e-11 * lost;
      continue;
    }
    const double edge = inside(c, a, i);
    for (std::size_t axis = 0; axis < expected.size(); ++axis) {
      const double size = expected[axis].row(i).cwiseAbs().sum();
      const double error = (expected[axis].row(i) - found[axis].row(i)).cwiseAbs().maxCoeff();
      if (rcond > 0) worst.add(error, 30 * eps * lost / (rcond * edge) * size, i);
    }
  }
  EXPECT_WITHIN(worst);
  EXPECT_EQ(outcomes, 0);
}

void expect_identical(const Operator& a, const Operator& b, double factor) {
  EXPECT_EQ(a.rows.outcome, b.rows.outcome);
  EXPECT_EQ(a.rows.reciprocal_condition, b.rows.reciprocal_condition);
  for (std::size_t axis = 0; axis < a.axes.size(); ++axis) {
    ASSERT_EQ(a.axes[axis].nonZeros(), b.axes[axis].nonZeros());
    const auto n = a.axes[axis].nonZeros();
    EXPECT_TRUE(std::equal(a.axes[axis].innerIndexPtr(), a.axes[axis].innerIndexPtr() + n,
                           b.axes[axis].innerIndexPtr()));
    EXPECT_EQ((a.axes[axis].coeffs() * factor - b.axes[axis].coeffs()).abs().maxCoeff(), 0);
  }
}

namespace {

void a_translation_changes_nothing(const RandomCase& c, const Operator& op) {
  SCOPED_TRACE(__func__);
  const Positions x = c.cloud.positions().array() + c.translation;
  expect_identical(op, c.assembled(Cloud(x, c.cloud_options()), c.supports));
}

void the_unit_of_length_enters_as_a_power(const RandomCase& c, const Operator& op, Random& random) {
  SCOPED_TRACE(__func__);
  if (c.scheme.weight == Weight::DiffuseNs && c.options.on_degenerate == OnDegenerate::Lower)
    return;  // some rows lack a power of length, others do not
  const double unit = std::ldexp(1.0, random.below(61) - 30);
  CloudOptions options = c.cloud_options();
  for (int a = 0; a < c.dimension() && options.volumes.size() > 0; ++a) options.volumes *= unit;
  for (double& length : options.box) length *= unit;
  expect_identical(op, c.assembled(Cloud(c.cloud.positions() * unit, options), c.supports * unit),
                   std::pow(unit, -c.power()));
}

void permuted_points_permute_the_matrix(const RandomCase& c, const Operator& op, Random& random) {
  SCOPED_TRACE(__func__);
  const std::vector<int> order = random.permutation(c.size());
  CloudOptions options = c.cloud_options();
  if (c.cloud.has_volumes()) options.volumes = Eigen::VectorXd(options.volumes(order));
  const Eigen::VectorXd supports =
      c.supports.size() > 1 ? Eigen::VectorXd(c.supports(order)) : c.supports;
  const Operator other =
      c.assembled(Cloud(c.cloud.positions()(order, Eigen::all), options), supports);
  std::vector<int> back(order.size());
  for (int k = 0; k < c.size(); ++k) back[order[k]] = k;
  Operator restored = other;
  restored.rows.degree = other.rows.degree(back).eval();
  restored.rows.supports = other.rows.supports(back).eval();
  restored.rows.reciprocal_condition = other.rows.reciprocal_condition(back).eval();
  Dense matrices = dense(other);
  for (Eigen::MatrixXd& matrix : matrices) matrix = Eigen::MatrixXd(matrix(back, back));
  expect_same(c, op, dense(op), restored, matrices, 1);
}

/// The least sum (r/h)^5 psi, h^2, which a positive stencil has in common with its image, be it another
/// one where several are as good.
Eigen::VectorXd costs(const RandomCase& c, const Operator& op) {
  Eigen::VectorXd cost = Eigen::VectorXd::Zero(c.size());
  for (int i = 0; i < c.size(); ++i)
    for (SparseMatrix::InnerIterator a(op.matrix(), i); a; ++a) {
      const double h = op.rows.supports[i];
      cost[i] +=
          std::pow(c.displacement(i, static_cast<int>(a.col()), h).norm(), 5) * a.value() * h * h;
    }
  return cost;
}

void a_rotation_turns_tensors(const RandomCase& c, const Operator& op, const Eigen::MatrixXd& R,
                              double lost) {
  SCOPED_TRACE(__func__);
  if (c.scheme.consistency == Consistency::Normalized) return;  // knows axes, not directions
  CloudOptions options = c.cloud_options();
  for (int a = 0; a < c.dimension(); ++a) {  // quarter turns in boxes
    Eigen::Index from;
    R.row(a).cwiseAbs().maxCoeff(&from);
    options.box[a] = c.cloud.box()[from];
  }
  const Cloud turned_cloud(dense_product(c.cloud.positions(), R.transpose()), options);
  const Operator turned = c.assembled(turned_cloud, c.supports);
  if (c.positive()) {
    const Eigen::VectorXd a = costs(c, op);
    RandomCase other = c;
    other.cloud = turned_cloud;
    const Eigen::VectorXd b = costs(other, turned);
    Worst worst;
    for (int i = 0; i < c.size(); ++i)  // rounding may tip whether a row has to be widened
      if (op.rows.degree[i] == 2 && turned.rows.degree[i] == 2 &&
          op.rows.supports[i] == turned.rows.supports[i])
        worst.add(std::abs(a[i] - b[i]), 30 * eps * lost / op.rows.reciprocal_condition[i] * a[i],
                  i);
    EXPECT_WITHIN(worst);
    return;
  }
  expect_same(c, op, gradpsi::turned(c.scheme.derivative, dense(op), R), turned, dense(turned),
              lost);
}

void rotations_turn_tensors(const RandomCase& c, const Operator& op, Random& random) {
  const int d = c.dimension();
  if (d == 1) return;
  Eigen::MatrixXd quarter = Eigen::MatrixXd::Zero(d, d);
  const int axis = random.below(d), other = (axis + 1) % d;
  quarter.diagonal().setOnes();
  quarter(axis, axis) = quarter(other, other) = 0;
  quarter(axis, other) = -1;
  quarter(other, axis) = 1;
  a_rotation_turns_tensors(c, op, quarter, 1);
  if (c.cloud.box() != std::array<double, 3>{0, 0, 0}) return;
  Eigen::Matrix3d R =
      Eigen::AngleAxisd(random.between(-3, 3), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  if (d == 3)
    R = Eigen::AngleAxisd(random.between(-3, 3), Eigen::Vector3d(1, 2, -1).normalized()) * R;
  // Coordinates are rounded anew, and so are distances.
  const double extent = c.cloud.positions().cwiseAbs().maxCoeff();
  const double lost = 1 + extent / nearest_distances(c.cloud).minCoeff();
  a_rotation_turns_tensors(c, op, R.topLeftCorner(d, d), lost);
}

}  // namespace

void other_views_agree(const RandomCase& c, const Operator& op, Random& random) {
  a_translation_changes_nothing(c, op);
  the_unit_of_length_enters_as_a_power(c, op, random);
  permuted_points_permute_the_matrix(c, op, random);
  rotations_turn_tensors(c, op, random);
}

}  // namespace gradpsi
