// Memory that passes from the library to its user and back, in every type of the interface: allocated on one
// side, resized, freed or moved on by the other. Right with any options that the user compiles with.
#include <Eigen/Dense>
#include <gradpsi/gradpsi.hpp>
#include <iostream>

namespace {

bool close(double a, double b) {
  return std::abs(a - b) <= 1e-12 * std::max(std::abs(a), std::abs(b));
}

bool products_agree(const gradpsi::SparseMatrix& A, const Eigen::VectorXd& x) {
  Eigen::VectorXd own(3);
  gradpsi::multiply(A, x, own);
  gradpsi::DenseVector shared;
  gradpsi::multiply(A, own, shared);
  Eigen::MatrixXd X(x.size(), 2), Y;
  X << x, own;
  gradpsi::multiply(A, X, Y);
  return (Y.col(1) - shared).norm() <= 1e-12 * shared.norm() &&
         (A * x - Y.col(0)).norm() <= 1e-12 * own.norm();
}

/// Everything on a line of `size` points: of many sizes, since what vector code does with the last few
/// numbers depends on it, and where malloc() puts them.
bool right(int size) {
  const gradpsi::Cloud line = gradpsi::make_cloud({.dimension = 1, .points_per_side = size});
  Eigen::VectorXd volumes = 2 * line.volumes();
  gradpsi::CloudOptions options{.volumes = volumes};
  gradpsi::Positions positions = line.positions();
  const gradpsi::Cloud cloud(std::move(positions), std::move(options));

  gradpsi::Neighbours near =
      gradpsi::find_neighbours(cloud, Eigen::VectorXd::Constant(size, 3.5 / size));
  near.supports.conservativeResize(size + 5);
  near.supports.conservativeResize(size);
  gradpsi::Operator op = gradpsi::assemble("laplacian-mixed-zoc", cloud, near);
  if (!products_agree(op.matrix(), cloud.positions().col(0).array().square())) return false;

  const gradpsi::RowDiagnosis rows = gradpsi::diagnose("laplacian-mixed-zoc", cloud, op);
  const Eigen::VectorXd kappa = Eigen::VectorXd::Ones(size);
  op = gradpsi::with_conductivity(std::move(op), kappa);
  Eigen::VectorXd u = cloud.positions().col(0);
  gradpsi::ImplicitDiffusion(cloud, op, {},
                             {.time_step = 0.01, .source = Eigen::VectorXd::Zero(size)})
      .step(u);
  gradpsi::Table table;
  table.add("u", u);
  table.add("amplification", rows.amplification);
  gradpsi::DenseMatrix values = std::move(table.values);
  table.values = values.topRows(size - 1);
  return close(cloud.volumes().sum(), 2) && close(u.mean(), 0.5) &&
         close(values.col(0).sum(), u.sum()) &&
         close(table.column("u").sum(), u.head(size - 1).sum()) &&
         gradpsi::spectrum(op.matrix(), cloud.volumes()).values.size() == size;
}

}  // namespace

int main() {
  for (int size = 8; size < 40; ++size)
    if (!right(size)) return 1;
  // Blocks of products are aligned as the instructions want it.
  const Eigen::MatrixXd A = Eigen::MatrixXd::Identity(99, 99);
  if ((A * A - A).norm() > 0) return 1;
  std::cout << "right\n";
}
