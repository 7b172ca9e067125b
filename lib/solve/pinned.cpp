#include "solve/pinned.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "gradpsi/error.hpp"
#include "matrix/csr.hpp"

namespace gradpsi {
namespace {

/// All but one element of a vector or of a matrix's rows.
auto without(const auto& all, Eigen::Index one) {
  auto result = all;
  result.resize(all.rows() - 1, all.cols());
  result.topRows(one) = all.topRows(one);
  result.bottomRows(all.rows() - 1 - one) = all.bottomRows(all.rows() - 1 - one);
  return result;
}

SparseMatrix without_row_and_column(const SparseMatrix& A, int one) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(A.nonZeros());
  const auto place = [one](Eigen::Index i) { return static_cast<int>(i > one ? i - 1 : i); };
  for (int i = 0; i < A.rows(); ++i)
    for (SparseMatrix::InnerIterator a(A, i); a; ++a)
      if (i != one && a.col() != one) entries.emplace_back(place(i), place(a.col()), a.value());
  SparseMatrix result(A.rows() - 1, A.cols() - 1);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

Cloud without(const Cloud& cloud, int one) {
  if (cloud.size() == 0) return cloud;
  std::vector<std::int64_t> numbers;
  for (int i = 0; i < cloud.size(); ++i)
    if (i != one) numbers.push_back(cloud.number(i));
  return Cloud(without(cloud.positions(), one),
               {.volumes = cloud.has_volumes() ? without(cloud.volumes(), one) : DenseVector(),
                .box = cloud.box(),
                .numbers = std::move(numbers)});
}

/// The system without the equation and the unknown of a row that is none of a wall's.
LinearSystem without(const LinearSystem& system, int one) {
  LinearSystem result{.A = without_row_and_column(system.A, one),
                      .points = {without(system.points.cloud, one)},
                      .options = system.options,
                      .scale = without(system.scale, one)};
  if (system.diffusivities.size() > 0) result.diffusivities = without(system.diffusivities, one);
  for (const int i : system.points.walls) result.points.walls.push_back(i > one ? i - 1 : i);
  return result;
}

class Pinned : public PreparedMethod {
 public:
  explicit Pinned(std::unique_ptr<PreparedMethod> method) : method_(std::move(method)) {}

  void prepare(const LinearSystem& system, const Choice& choice) override {
    const std::vector<int>& walls = system.points.walls;
    held_ = 0;
    while (std::ranges::find(walls, held_) != walls.end()) ++held_;
    part_ = without(system, held_);
    method_->prepare(part_, choice);
    SolveReport unread;
    const DenseVector ones = DenseVector::Ones(part_.size());
    columns_.take(ones, DenseVector::Zero(part_.size()));
    if (!method_->solve(part_, columns_, system.options.max_iterations, unread))
      throw SolverError("constants are in the null space, and something else is nearly, too",
                        unread.residual);
    of_ones_ = solution().col(0);
    row_of_ones_ = 1 - row_product(system.A, held_, of_ones_.data());
  }

  bool solve(const LinearSystem& system, Columns& columns, int most_iterations,
             SolveReport& result) override {
    columns_.take(without(columns.rhs, held_), without(columns.solution, held_));
    if (!method_->solve(part_, columns_, most_iterations, result)) return false;
    columns.solution = solution();
    result.residual = result.removed = 0;
    for (int c = 0; c < columns.count(); ++c) {
      auto x = columns.solution.col(c);
      auto b = columns.rhs.col(c);
      const double size = b.norm();
      const double constant = (b[held_] - row_product(system.A, held_, x.data())) / row_of_ones_;
      b.array() -= constant;
      x -= constant * of_ones_;
      const double unit = std::ldexp(1.0, columns.units[c]);
      x.array() += *system.options.mean / unit - system.scale.dot(x) / system.scale.sum();
      const double left = residual(system.A, b.data(), x.data(), columns.residuals.col(c).data(),
                                   system.options.threads);
      result.residual = std::max(result.residual, size > 0 ? left / size : left);
      result.removed = std::max(result.removed, std::abs(constant * unit));
    }
    return true;
  }

  std::string description() const override { return method_->description(); }
  FactorReport factor() const override { return method_->factor(); }

 private:
  /// The part's, 0 where it is held.
  DenseMatrix solution() const {
    DenseMatrix part(part_.size(), columns_.count()), all(part_.size() + 1, columns_.count());
    columns_.give(part);
    const Eigen::Index below = part_.size() - held_;
    all.topRows(held_) = part.topRows(held_);
    all.row(held_).setZero();
    all.bottomRows(below) = part.bottomRows(below);
    return all;
  }

  std::unique_ptr<PreparedMethod> method_;
  LinearSystem part_;
  Columns columns_;
  int held_ = 0;
  DenseVector of_ones_;  // the part's solution for a right-hand side of ones
  double row_of_ones_ = 1;
};

}  // namespace

std::unique_ptr<PreparedMethod> pinned(std::unique_ptr<PreparedMethod> method) {
  return std::make_unique<Pinned>(std::move(method));
}

}  // namespace gradpsi
