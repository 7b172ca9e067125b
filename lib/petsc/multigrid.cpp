#include "petsc/multigrid.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>

#include "gradpsi/spmv.hpp"
#include "multigrid/for_petsc.hpp"
#include "petsc/collective.hpp"
#include "petsc/vectors.hpp"

namespace gradpsi::petsc {
namespace {

/// All processes' values, by rank, to each.
class Gathering {
 public:
  Gathering(MPI_Comm comm, int own) : comm_(comm), counts_(gathered(comm, own)) {}

  /// @param of_each  how many values each of the counted has
  DenseVector operator()(const double* own, int of_each) const {
    std::vector<int> counts, places;
    int sum = 0;
    for (const int count : counts_) {
      counts.push_back(of_each * count);
      places.push_back(sum);
      sum += counts.back();
    }
    DenseVector all(sum);
    MPI_Allgatherv(own, counts[rank_of(comm_)], MPI_DOUBLE, all.data(), counts.data(),
                   places.data(), MPI_DOUBLE, comm_);
    return all;
  }
  DenseVector operator()(const DenseVector& own) const { return (*this)(own.data(), 1); }

 private:
  MPI_Comm comm_;
  std::vector<int> counts_;
};

std::vector<CoarseLevel> all_levels(MPI_Comm comm, const RowPoints& rows, double unit,
                                    int threads) {
  const int d = rows.cloud.dimension();
  const Gathering all(comm, rows.cloud.size());
  DenseVector marks = DenseVector::Zero(rows.cloud.size());
  marks(rows.walls).setOnes();
  const DenseVector x = all(rows.cloud.positions().data(), d), left_out = all(marks);
  const Medium medium{all(rows.medium.diffusivities), all(rows.medium.masses)};
  const Cloud points(Eigen::Map<const Positions>(x.data(), x.size() / d, d),
                     {.volumes = all(rows.cloud.volumes()), .box = rows.cloud.box()});
  return coarser_levels(points, medium, {left_out.begin(), left_out.end()}, unit, threads);
}

/// Some rows of a matrix, whose columns may come in any order.
SingleSparseMatrix rows_of(const SingleSparseMatrix& A, int first, int count) {
  const int* const outer = A.outerIndexPtr() + first;
  SingleSparseMatrix part(count, A.cols());
  part.resizeNonZeros(outer[count] - outer[0]);
  for (int k = 0; k <= count; ++k) part.outerIndexPtr()[k] = outer[k] - outer[0];
  std::copy_n(A.innerIndexPtr() + outer[0], part.nonZeros(), part.innerIndexPtr());
  std::copy_n(A.valuePtr() + outer[0], part.nonZeros(), part.valuePtr());
  return part;
}

}  // namespace

RowLevels row_levels(MPI_Comm comm, RowPoints points, int threads) {
  const int own = points.cloud.size();
  const double sum =
      sum_of(comm, points.cloud.volumes().cwiseProduct(points.smoother.diagonal.cwiseAbs()).sum());
  const auto count = static_cast<double>(sum_of(comm, std::int64_t{own}));
  const double unit = sum > 0 ? count / sum : 1;
  std::vector<CoarseLevel> levels = all_levels(comm, points, unit, threads);
  if (levels.empty()) throw NoHierarchy("there are too few points");
  const SingleSparseMatrix all = std::move(levels.front().interpolation);
  levels.front().restriction = SingleSparseMatrix();
  return {std::move(points), unit, std::move(levels), rows_of(all, sum_before(comm, own), own)};
}

Multigrid::Multigrid(MPI_Comm comm, Mat A, RowLevels levels, const DenseVector& scale, int threads)
    : comm_(comm),
      A_(A),
      interpolation_(std::move(levels.interpolation)),
      restriction_(interpolation_.transpose()),
      step_(levels.points.smoother.step.cwiseQuotient(scale)),
      weight_(levels.unit * levels.points.cloud.volumes().cwiseQuotient(scale)),
      own_(scale.size()),
      product_(vector_like(A)) {
  coarse_.make(std::move(levels.coarser),
               {false, std::numeric_limits<double>::infinity(), threads});
  const std::vector<int>&walls = levels.points.walls, &weak = levels.points.weak;
  if (anywhere(comm, !walls.empty())) {
    walls_.emplace(comm, A, walls);
    if (*walls_) step_(walls).setZero();
  }
  if (anywhere(comm, !weak.empty())) weak_.emplace(comm, A, weak);
}

void Multigrid::apply(Vec r, Vec z) {
  const double* given;
  check(VecGetArrayRead(r, &given));
  const auto correct_walls = [&] {
    if (walls_) walls_->correct(r, z);
  };
  /// Leaves weight (r - A z) in own_.
  const auto find_residuals = [&](const DenseVector& weight) {
    check(MatMult(A_, z, product_.get()));
    for_each_entry(product_.get(),
                   [&](PetscInt k, double& v) { own_[k] = weight[k] * (given[k] - v); });
  };
  const auto add_own = [&] { for_each_entry(z, [&](PetscInt k, double& v) { v += own_[k]; }); };

  for_each_entry(z, [&](PetscInt k, double& v) { v = step_[k] * given[k]; });
  correct_walls();
  find_residuals(weight_);
  DenseVector& coarse = coarse_.right_hand_side();
  multiply(restriction_, own_, coarse, 1);
  MPI_Allreduce(MPI_IN_PLACE, coarse.data(), static_cast<int>(coarse.size()), MPI_DOUBLE, MPI_SUM,
                comm_);
  multiply(interpolation_, coarse_.solve(), own_, 1);
  add_own();
  correct_walls();
  find_residuals(step_);
  add_own();
  correct_walls();
  if (weak_) weak_->correct(r, z);
  check(VecRestoreArrayRead(r, &given));
}

std::string Multigrid::description() const {
  return "multigrid on " + std::to_string(coarse_.size() + 1) + " levels of points" +
         (weak_ ? ", rows of weak diagonals corrected by themselves" : "");
}

}  // namespace gradpsi::petsc
