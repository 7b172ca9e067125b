#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <string>

#include "base/sum.hpp"
#include "base/text.hpp"
#include "cloud/points.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/petsc.hpp"
#include "petsc/collective.hpp"
#include "petsc/matrix.hpp"

namespace gradpsi::petsc {
namespace {

/// Distances of own points to the nearest other one, exact where they are at most `reach`.
DenseVector nearest_within(const Partition& partition, double reach, int threads) {
  const Subdomain mine(partition, DenseVector::Constant(1, reach));
  DenseVector distances;
  together(partition.comm(),
           [&] { distances = nearest_distances(mine.cloud(), threads)(mine.own()); });
  return distances;
}

/// Throws unless the halo has all within a multiple of the supports, or within half of a periodic box.
void check_supports(const Subdomain& mine, const VectorView& supports, double factor) {
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

/// The lists of own points and of their neighbours, too.
Neighbours further(const Scheme& scheme, const Subdomain& mine, const Neighbours& near,
                   const AssemblyOptions& options) {
  if (options.on_degenerate == OnDegenerate::Widen)
    throw InvalidInput(name(scheme) + " cannot be widened by several processes");
  std::vector<int> rows = mine.own();
  rows.insert(rows.end(), near.indices.begin(), near.indices.end());
  std::ranges::sort(rows);
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  return gradpsi::find_neighbours(mine.cloud(), near.supports, rows, options.threads);
}

/// The subdomain's cloud with volumes by number density, the halo's from their owners.
Cloud with_number_densities(const Subdomain& mine, const Neighbours& near,
                            const AssemblyOptions& options) {
  const Cloud& cloud = mine.cloud();
  DenseVector own;
  together(mine.partition().comm(), [&] {
    const auto measures = options.on_surface ? number_density_areas : number_density_volumes;
    own = measures(cloud, near, options.kernel, options.threads)(mine.own());
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

/// Throws if points coincide, counting those of all processes.
void check_coincidences(const Partition& partition) {
  const MPI_Comm comm = partition.comm();
  const Subdomain mine(partition, DenseVector::Zero(1));
  const Coincidences found = coincidences(mine.cloud());
  std::int64_t count = 0, first = std::numeric_limits<std::int64_t>::max();
  for (const int i : found.points) {
    if (!std::ranges::binary_search(mine.own(), i)) continue;  // another process counts it
    first = std::min(first, mine.cloud().number(i));
    ++count;
  }
  const std::int64_t lowest = least_of(comm, first), all = sum_of(comm, count);
  together(comm, [&] {
    if (count > 0 && first == lowest)
      throw InvalidInput(words(found, mine.cloud(), all, partition.size()));
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
  const Subdomain mine(partition, DenseVector::Zero(1));
  std::vector<int> result;
  together(partition.comm(), [&] {
    const std::vector<int> distinct = distinct_points(mine.cloud());
    for (std::size_t k = 0; k < mine.own().size(); ++k)
      if (!std::ranges::binary_search(distinct, mine.own()[k]))
        result.push_back(static_cast<int>(k));
  });
  return result;
}

Neighbours find_neighbours(const Subdomain& mine, const VectorView& supports, int threads) {
  const MPI_Comm comm = mine.partition().comm();
  // A process with a single point has one support either way.
  const bool one = !anywhere(comm, supports.size() != 1);
  together(comm, [&] {
    if (!one && supports.size() != std::ssize(mine.own()))
      throw InvalidInput("there are " + std::to_string(supports.size()) + " supports for " +
                         std::to_string(mine.own().size()) + " points");
  });
  const DenseVector all = one ? DenseVector(supports) : DenseVector(mine.spread(supports));
  Neighbours near;
  try {
    together(comm, [&] {
      check_supports(mine, all, 1);
      near = gradpsi::find_neighbours(mine.cloud(), all, mine.own(), threads);
    });
  } catch (const InvalidInput&) {
    check_coincidences(mine.partition());
    throw;
  }
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
    check_supports(mine, near.supports, reach(scheme) * (widens ? widest : 1));
    AssemblyOptions own = options;
    if (!own.rows) own.rows = mine.own();
    const Cloud& cloud = with_volumes ? *with_volumes : mine.cloud();
    result = gradpsi::assemble(
        scheme, cloud, reach(scheme) == 1 ? near : further(scheme, mine, near, options), own);
  });
  return result;
}

Operator with_conductivity(Operator laplacian, const Subdomain& mine,
                           const VectorView& conductivity, Mean mean) {
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
  const DenseVector all = mine.spread(conductivity);
  Operator result;
  together(comm, [&] { result = gradpsi::with_conductivity(std::move(laplacian), all, mean); });
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
