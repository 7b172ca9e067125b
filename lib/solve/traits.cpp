#include "solve/traits.hpp"

#include <cmath>

#include "base/median.hpp"
#include "base/parallel.hpp"
#include "gradpsi/error.hpp"
#include "matrix/checks.hpp"
#include "multigrid/medium.hpp"
#include "solve/for_petsc.hpp"

namespace gradpsi {

namespace {

DenseVector row_stiffness(const SparseMatrix& A, const Cloud& points,
                          const std::vector<int>& diagonal, const DenseVector& diffusivities,
                          int threads) {
  DenseVector ratios(A.rows());
  parallel_chunks(static_cast<int>(A.rows()), 1024, threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const RowSum row = row_sum(A, k);
      const double squared_spacing =
          std::pow(points.volumes()[diagonal[k]], 2.0 / points.dimension());
      ratios[k] = row.sum > 0 && !row.vanishes() ? diffusivities[k] / (row.sum * squared_spacing)
                                                 : std::numeric_limits<double>::infinity();
    }
  });
  return ratios;
}

}  // namespace

RowTraits row_traits(const SparseMatrix& A, const Cloud& points, const std::vector<int>& diagonal,
                     int threads) {
  RowTraits result{is_dominant(A, diagonal, threads), {}};
  if (points.has_volumes())
    result.stiffness = row_stiffness(A, points, diagonal,
                                     row_diffusivities(A, points, diagonal, threads), threads);
  return result;
}

Traits traits(const LinearSystem& system) {
  const SparseMatrix& A = system.A;
  const int threads = system.options.threads;
  const SystemPoints& points = system.points;
  Traits result{.unknowns = A.rows(),
                .dimension = points.cloud.dimension(),
                .symmetric = is_symmetric(A, system.scale, threads),
                .dominant = is_dominant(A, {}, threads),
                .reversed = !reversed_rows(A).empty(),
                .walls = !points.walls.empty(),
                .solves = expected_solves(system.options)};
  if (points.cloud.has_volumes())
    result.stiffness =
        median(row_stiffness(A, points.cloud, system.diagonal(), system.diffusivities, threads));
  return result;
}

void check_rows(const SparseMatrix& A, const std::function<std::string(int)>& name) {
  for (int i = 0; i < A.rows(); ++i) {
    bool zero = true;
    for (SparseMatrix::InnerIterator a(A, i); a; ++a) {
      if (!std::isfinite(a.value()))
        throw InvalidInput("the matrix is not finite in the row of " + name(i));
      zero = zero && a.value() == 0;
    }
    if (zero) throw InvalidInput("the matrix has only zeros in the row of " + name(i));
  }
}

}  // namespace gradpsi
