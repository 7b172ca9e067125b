#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <string>

#include "../sum.hpp"
#include "../text.hpp"
#include "collective.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/petsc.hpp"
#include "matrix.hpp"

namespace gradpsi::petsc {
namespace {

/// Distances of own points to the nearest other one, exact where they are at most `reach`.
Eigen::VectorXd nearest_within(const Partition& partition, double reach, int threads) {
  const Subdomain mine(partition, Eigen::VectorXd::Constant(1, reach));
  Eigen::VectorXd distances;
  together(partition.comm(),
           [&] { distances = nearest_distances(mine.cloud(), threads)(mine.own()); });
  return distances;
}

void check_isolation(const Subdomain& mine, const Neighbours& near) {
  const MPI_Comm comm = mine.partition().comm();
  std::int64_t isolated = 0;
  for (const int i : mine.own()) isolated += near.count(i) == 0;
  const std::int64_t n = mine.partition().size();
  if (isolated = sum_of(comm, isolated); n < 2 || isolated <= n / 2) return;
  together(comm, [&] {
    throw InvalidInput(std::to_string(isolated) + " of " + std::to_string(n) +
                       " points have no neighbour within their support");
  });
}

}  // namespace

double spacing(const Partition& partition, int threads) {
  const MPI_Comm comm = partition.comm();
  const Cloud& own = partition.cloud();
  if (anywhere(comm, own.has_volumes())) {
    Sum here, sum;
    for (const double volume : own.volumes()) here += volume;
    const auto high = gathered(comm, here.high), low = gathered(comm, here.low);
    for (std::size_t rank = 0; rank < high.size(); ++rank) sum += Sum{high[rank], low[rank]};
    return std::pow(sum.value() / static_cast<double>(partition.size()), 1.0 / own.dimension());
  }
  if (partition.size() < 2)
    together(comm, [&] {
      throw InvalidInput("the spacing of " + std::to_string(partition.size()) +
                         " point(s) without volumes is not defined");
    });
  // Distances among own points are bounds: half of all points have another one within their median.
  const double bound = median(comm, nearest_within(partition, 0, threads));
  const double spacing = median(comm, nearest_within(partition, bound, threads));
  if (!(spacing > 0))
    together(comm, [] {
      throw InvalidInput("most points coincide with another one; their spacing is 0");
    });
  return spacing;
}

std::vector<int> coincident_points(const Partition& partition) {
  const Subdomain mine(partition, Eigen::VectorXd::Zero(1));
  std::vector<int> result;
  together(partition.comm(), [&] {
    const std::vector<int> distinct = distinct_points(mine.cloud());
    for (std::size_t k = 0; k < mine.own().size(); ++k)
      if (!std::ranges::binary_search(distinct, mine.own()[k]))
        result.push_back(static_cast<int>(k));
  });
  return result;
}

Neighbours find_neighbours(const Subdomain& mine, const Eigen::VectorXd& supports, int threads) {
  const MPI_Comm comm = mine.partition().comm();
  // A process with a single point has one support either way.
  const bool one = !anywhere(comm, supports.size() != 1);
  together(comm, [&] {
    if (!one && supports.size() != std::ssize(mine.own()))
      throw InvalidInput("there are " + std::to_string(supports.size()) + " supports for " +
                         std::to_string(mine.own().size()) + " points");
  });
  const Eigen::VectorXd all = one ? supports : Eigen::VectorXd(mine.spread(supports));
  Neighbours near;
  together(comm, [&] { near = gradpsi::find_neighbours(mine.cloud(), all, mine.own(), threads); });
  check_isolation(mine, near);
  return near;
}

Operator assemble(const Scheme& scheme, const Subdomain& mine, const Neighbours& near,
                  const AssemblyOptions& options) {
  const MPI_Comm comm = mine.partition().comm();
  Cloud cloud = mine.cloud();
  if (!anywhere(comm, cloud.has_volumes())) {
    Eigen::VectorXd own;
    together(comm, [&] {
      own = number_density_volumes(cloud, near, options.kernel, options.threads)(mine.own());
    });
    CloudOptions with_volumes{.volumes = mine.spread(own), .box = cloud.box()};
    for (int i = 0; i < cloud.size(); ++i) with_volumes.numbers.push_back(cloud.number(i));
    cloud = Cloud(cloud.positions(), std::move(with_volumes));
  }
  Operator result;
  together(comm, [&] {
    AssemblyOptions own = options;
    if (!own.rows) own.rows = mine.own();
    result = gradpsi::assemble(scheme, cloud, near, own);
  });
  return result;
}

Operator with_conductivity(Operator laplacian, const Subdomain& mine,
                           const Eigen::VectorXd& conductivity, Mean mean) {
  const MPI_Comm comm = mine.partition().comm();
  together(comm, [&] {
    if (conductivity.size() != std::ssize(mine.own()))
      throw InvalidInput("there are " + std::to_string(conductivity.size()) +
                         " conductivities for " + std::to_string(mine.own().size()) + " points");
    for (Eigen::Index k = 0; k < conductivity.size(); ++k)
      if (!(conductivity[k] > 0 && std::isfinite(conductivity[k])))
        throw InvalidInput("the conductivity at point " +
                           std::to_string(mine.cloud().number(mine.own()[k])) +
                           " must be > 0 and finite, not " + shortest(conductivity[k]));
  });
  const Eigen::VectorXd all = mine.spread(conductivity);
  Operator result;
  together(comm, [&] { result = gradpsi::with_conductivity(std::move(laplacian), all, mean); });
  return result;
}

Handle<Mat> make_matrix(MPI_Comm comm, const SparseMatrix& rows,
                        const std::vector<PetscInt>& columns) {
  const auto m = static_cast<PetscInt>(rows.rows());
  std::vector<PetscInt> offsets(rows.outerIndexPtr(), rows.outerIndexPtr() + m + 1);
  std::vector<PetscInt> indices(rows.nonZeros());
  std::vector<double> values(rows.nonZeros());
  together(comm, [&] {
    std::vector<std::pair<PetscInt, double>> row;  // PETSc likes its columns to ascend
    for (PetscInt k = 0; k < m; ++k) {
      row.clear();
      for (SparseMatrix::InnerIterator a(rows, k); a; ++a)
        row.emplace_back(columns[a.col()], a.value());
      std::ranges::sort(row, {}, &std::pair<PetscInt, double>::first);
      for (std::size_t e = 0; e < row.size(); ++e)
        std::tie(indices[offsets[k] + e], values[offsets[k] + e]) = row[e];
    }
  });
  Mat matrix;
  check(MatCreateMPIAIJWithArrays(comm, m, m, PETSC_DETERMINE, PETSC_DETERMINE, offsets.data(),
                                  indices.data(), values.data(), &matrix));
  return Handle<Mat>(matrix);
}

std::vector<Handle<Mat>> matrices(const Subdomain& mine, const Operator& op) {
  const MPI_Comm comm = mine.partition().comm();
  together(comm, [&] {
    if (op.points != mine.own())
      throw InvalidInput("a matrix needs the rows of all own points, in order");
  });
  std::vector<PetscInt> own(mine.own().size());
  std::iota(own.begin(), own.end(), mine.partition().first());
  const std::vector<PetscInt> columns = mine.spread(own);
  std::vector<Handle<Mat>> result;
  for (const SparseMatrix& rows : op.axes) result.push_back(make_matrix(comm, rows, columns));
  return result;
}

}  // namespace gradpsi::petsc
