#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <string>

#include "base/memory.hpp"
#include "base/sum.hpp"
#include "base/text.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/petsc.hpp"
#include "petsc/collective.hpp"
#include "petsc/matrix.hpp"

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

/// Throws unless the halo has all within a multiple of the supports, or within half of a periodic box.
void check_supports(const Subdomain& mine, const Eigen::VectorXd& supports, double factor) {
  for (std::size_t k = 0; k < mine.own().size(); ++k) {
    double needed = factor * supports[supports.size() == 1 ? 0 : mine.own()[k]];
    for (const double length : mine.cloud().box())
      if (length > 0) needed = std::min(needed, length / 2);
    const double reach = mine.reach(static_cast<int>(k));
    if (needed > reach)  // what is no support at all is named by the search
      throw InvalidInput("the halo of point " + std::to_string(mine.cloud().number(mine.own()[k])) +
                         " reaches " + shortest(reach) + ", less than the " + shortest(needed) +
                         " that " + (factor > 1 ? "widened rows" : "its support") + " may need");
  }
}

/// The subdomain's cloud with volumes by number density, the halo's from their owners.
Cloud with_number_densities(const Subdomain& mine, const Neighbours& near,
                            const AssemblyOptions& options) {
  const Cloud& cloud = mine.cloud();
  Eigen::VectorXd own;
  together(mine.partition().comm(), [&] {
    own = number_density_volumes(cloud, near, options.kernel, options.threads)(mine.own());
  });
  CloudOptions result{.volumes = mine.spread(own), .box = cloud.box()};
  for (int i = 0; i < cloud.size(); ++i) result.numbers.push_back(cloud.number(i));
  return Cloud(cloud.positions(), std::move(result));
}

void check_isolation(const Subdomain& mine, const Neighbours& near) {
  const MPI_Comm comm = mine.partition().comm();
  std::int64_t isolated = 0;
  for (const int i : mine.own()) isolated += near.count(i) == 0;
  const std::int64_t n = mine.partition().size();
  if (isolated = sum_of(comm, isolated); n < 2 || isolated <= n / 2) return;
  throw InvalidInput(std::to_string(isolated) + " of " + std::to_string(n) +
                     " points have no neighbour within their support");
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
    throw InvalidInput("the spacing of " + std::to_string(partition.size()) +
                       " point(s) without volumes is not defined");
  // Distances among own points are bounds: half of all points, and the next one, have another point within
  // the upper one of their middle two.
  const double bound = middle_two(comm, nearest_within(partition, 0, threads)).second;
  const double spacing = median(comm, nearest_within(partition, bound, threads));
  if (!(spacing > 0))
    throw InvalidInput("most points coincide with another one; their spacing is 0");
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
  together(comm, [&] {
    check_supports(mine, all, 1);
    near = gradpsi::find_neighbours(mine.cloud(), all, mine.own(), threads);
  });
  check_isolation(mine, near);
  return near;
}

Operator assemble(const Scheme& scheme, const Subdomain& mine, const Neighbours& near,
                  const AssemblyOptions& options) {
  const MPI_Comm comm = mine.partition().comm();
  const bool widens = options.on_degenerate == OnDegenerate::Widen;
  std::optional<Cloud> with_volumes;
  if (!anywhere(comm, mine.cloud().has_volumes()))
    with_volumes.emplace(with_number_densities(mine, near, options));
  Operator result;
  together(comm, [&] {
    if (widens) check_supports(mine, near.supports, widest);
    AssemblyOptions own = options;
    if (!own.rows) own.rows = mine.own();
    result = gradpsi::assemble(scheme, with_volumes ? *with_volumes : mine.cloud(), near, own);
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

namespace {

/// Compressed rows of part of the columns.
struct Block {
  std::unique_ptr<PetscInt[]> offsets, columns;
  std::unique_ptr<double[]> values;

  Block(PetscInt rows, std::size_t entries)
      : offsets(std::make_unique_for_overwrite<PetscInt[]>(rows + 1)),
        columns(std::make_unique_for_overwrite<PetscInt[]>(entries)),
        values(std::make_unique_for_overwrite<double[]>(entries)) {
    prefer_large_pages(columns.get(), sizeof(PetscInt) * entries);
    prefer_large_pages(values.get(), sizeof(double) * entries);
    offsets[0] = 0;
  }
};

/// A process's rows as PETSc holds them: columns of its own, counted from its first, and those of others.
struct Blocks {
  Block own, others;
};

std::unique_ptr<Blocks> blocks(const SparseMatrix& rows, const std::vector<PetscInt>& columns,
                               PetscInt first) {
  const auto m = static_cast<PetscInt>(rows.rows());
  const auto is_own = [&](PetscInt column) { return column >= first && column < first + m; };
  std::size_t own_count = 0;
  for (Eigen::Index e = 0; e < rows.nonZeros(); ++e)
    own_count += is_own(columns[rows.innerIndexPtr()[e]]);
  auto result =
      std::make_unique<Blocks>(Block(m, own_count), Block(m, rows.nonZeros() - own_count));
  auto& [own, others] = *result;
  PetscInt own_end = 0, others_end = 0;
  std::vector<std::pair<PetscInt, double>> sorted;
  for (PetscInt k = 0; k < m; ++k) {
    sorted.clear();
    for (SparseMatrix::InnerIterator a(rows, k); a; ++a) {
      const PetscInt column = columns[a.col()];
      if (is_own(column)) {
        own.columns[own_end] = column - first;
        own.values[own_end++] = a.value();
      } else {
        sorted.emplace_back(column, a.value());
      }
    }
    std::ranges::sort(sorted, {}, &std::pair<PetscInt, double>::first);
    for (const auto& [column, value] : sorted) {
      others.columns[others_end] = column;
      others.values[others_end++] = value;
    }
    own.offsets[k + 1] = own_end;
    others.offsets[k + 1] = others_end;
  }
  return result;
}

/// Ties the blocks' memory to the matrix that uses it.
void attach(Mat matrix, std::unique_ptr<Blocks> memory) {
  PetscContainer container;
  check(PetscContainerCreate(PETSC_COMM_SELF, &container));
  check(PetscContainerSetPointer(container, memory.release()));
  check(PetscContainerSetUserDestroy(container, [](void* blocks) -> PetscErrorCode {
    delete static_cast<Blocks*>(blocks);
    return 0;
  }));
  check(PetscObjectCompose(reinterpret_cast<PetscObject>(matrix), "gradpsi blocks",
                           reinterpret_cast<PetscObject>(container)));
  check(PetscContainerDestroy(&container));
}

}  // namespace

Handle<Mat> make_matrix(MPI_Comm comm, const SparseMatrix& rows,
                        const std::vector<PetscInt>& columns) {
  const auto m = static_cast<PetscInt>(rows.rows());
  const std::int64_t before = sum_before(comm, std::int64_t{m});
  std::unique_ptr<Blocks> memory;
  together(comm, [&] { memory = blocks(rows, columns, static_cast<PetscInt>(before)); });
  Mat matrix;
  // Nothing is copied: MatCreateMPIAIJWithArrays() would, and take ten times as long.
  check(MatCreateMPIAIJWithSplitArrays(
      comm, m, m, PETSC_DETERMINE, PETSC_DETERMINE, memory->own.offsets.get(),
      memory->own.columns.get(), memory->own.values.get(), memory->others.offsets.get(),
      memory->others.columns.get(), memory->others.values.get(), &matrix));
  Handle<Mat> result(matrix);
  attach(matrix, std::move(memory));
  return result;
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
