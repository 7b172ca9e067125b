#include "solve/traits.hpp"

#include <cmath>
#include <utility>

#include "base/median.hpp"
#include "gradpsi/error.hpp"
#include "matrix/checks.hpp"
#include "solve/for_petsc.hpp"
#include "solve/twin.hpp"

namespace gradpsi {

namespace {

DenseVector row_stiffness(const SparseMatrix& A, const Cloud& points,
                          const std::vector<int>& diagonal, int threads) {
  DenseVector ratios = row_diffusivities(A, points, diagonal, threads);
  for (int k = 0; k < A.rows(); ++k) {
    const RowSum row = row_sum(A, k);
    const double squared_spacing =
        std::pow(points.volumes()[diagonal[k]], 2.0 / points.dimension());
    ratios[k] = row.sum > 0 && !row.vanishes() ? ratios[k] / (row.sum * squared_spacing)
                                               : std::numeric_limits<double>::infinity();
  }
  return ratios;
}

}  // namespace

RowTraits row_traits(const SparseMatrix& A, const Cloud& points, const std::vector<int>& diagonal,
                     int threads) {
  RowTraits result{is_dominant(A, diagonal), {}};
  if (points.has_volumes()) result.stiffness = row_stiffness(A, points, diagonal, threads);
  return result;
}

Traits traits(const LinearSystem& system) {
  const auto& [A, points, options, scale] = system;
  RowTraits rows = row_traits(A, points.cloud, system.diagonal(), options.threads);
  Traits result{.unknowns = A.rows(),
                .dimension = points.cloud.dimension(),
                .symmetric = is_symmetric(A, scale),
                .dominant = rows.dominant,
                .reversed = !reversed_rows(A).empty(),
                .walls = !points.walls.empty()};
  if (rows.stiffness.size() > 0) result.stiffness = median(std::move(rows.stiffness));
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
