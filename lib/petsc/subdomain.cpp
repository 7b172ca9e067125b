#include <set>
#include <string>

#include "gradpsi/error.hpp"
#include "petsc/collective.hpp"
#include "petsc/halo.hpp"
#include "petsc/partition.hpp"

namespace gradpsi::petsc {
namespace {

void check_reach(const Partition& partition, const VectorView& reach) {
  if (reach.size() != 1 && reach.size() != partition.cloud().size())
    throw InvalidInput("there are " + std::to_string(reach.size()) + " reaches for " +
                       std::to_string(partition.cloud().size()) + " points");
  for (const double r : reach)
    if (!(r >= 0)) throw InvalidInput("a reach must be >= 0, not " + std::to_string(r));
}

}  // namespace

Subdomain::Subdomain(const Partition& partition, const VectorView& reach)
    : partition_(&partition), reach_(reach), cloud_(partition.cloud()) {
  const MPI_Comm comm = partition.comm();
  together(comm, [&] { check_reach(partition, reach); });
  const Cloud& own = partition.cloud();
  const std::vector<Outsider> others = halo(partition, in_box(own), reach);
  CloudOptions options{.box = own.box()};
  std::vector<PetscInt> places;
  std::vector<PetscSFNode> owners;
  const auto own_before = [&](std::int64_t number) {
    while (std::ssize(own_) < own.size() && own.number(static_cast<int>(own_.size())) < number) {
      options.numbers.push_back(own.number(static_cast<int>(own_.size())));
      own_.push_back(static_cast<int>(options.numbers.size()) - 1);
    }
  };
  std::set<PetscInt> sources;
  for (const Outsider& other : others) {
    own_before(other.number);
    places.push_back(static_cast<PetscInt>(options.numbers.size()));
    options.numbers.push_back(other.number);
    owners.push_back(other.owner);
    sources.insert(other.owner.rank);
  }
  own_before(partition.size());
  sources_ = static_cast<int>(sources.size());

  from_owners_ = star_forest(comm, own.size(), &places, owners);
  cloud_ = Cloud(Positions::Zero(std::ssize(options.numbers), own.dimension()), {});
  const Positions x = spread(own.positions());
  if (anywhere(comm, own.has_volumes())) options.volumes = spread(own.volumes());
  cloud_ = Cloud(x, std::move(options));
}

template <class T>
void Subdomain::spread(MPI_Datatype type, const T* of_own, T* of_all) const {
  for (std::size_t k = 0; k < own_.size(); ++k) of_all[own_[k]] = of_own[k];
  check(PetscSFBcastBegin(from_owners_.get(), type, of_own, of_all, MPI_REPLACE));
  check(PetscSFBcastEnd(from_owners_.get(), type, of_own, of_all, MPI_REPLACE));
}

DenseMatrix Subdomain::spread(const MatrixView& of_own) const {
  check_row_count(partition_->comm(), of_own.rows(), std::ssize(own_));
  DenseMatrix result(cloud_.size(), of_own.cols());
  for (Eigen::Index c = 0; c < of_own.cols(); ++c)
    spread(MPI_DOUBLE, of_own.col(c).data(), result.col(c).data());
  return result;
}

std::vector<PetscInt> Subdomain::spread(const std::vector<PetscInt>& of_own) const {
  check_row_count(partition_->comm(), std::ssize(of_own), std::ssize(own_));
  std::vector<PetscInt> result(cloud_.size());
  spread(MPIU_INT, of_own.data(), result.data());
  return result;
}

}  // namespace gradpsi::petsc
