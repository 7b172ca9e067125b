#include "petsc/partition.hpp"

#include <zoltan.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "gradpsi/error.hpp"
#include "petsc/collective.hpp"

namespace gradpsi::petsc {
namespace {

void check_zoltan(int code) {
  if (code == ZOLTAN_MEMERR) throw std::bad_alloc();
  if (code == ZOLTAN_FATAL) throw std::runtime_error("Zoltan could not partition the points");
}

/// Throws unless all processes have the same.
void check_agreement(MPI_Comm comm, const Cloud& given) {
  // A process without points cannot say whether they have volumes.
  const int kind = given.size() == 0 ? 0 : given.has_volumes() ? 1 : 2;
  if (largest_of(comm, kind) == 2 && least_of(comm, kind == 0 ? 2 : kind) == 1)
    throw InvalidInput("some processes' points have volumes, others none");
  const auto& box = given.box();
  for (const double x : {double(given.dimension()), box[0], box[1], box[2]})
    if (least_of(comm, x) != largest_of(comm, x))
      throw InvalidInput("the processes' points do not agree in their dimension or periodic box");
}

/// What Zoltan asks about.
struct Objects {
  const Positions& x;
  unsigned rank;
};

int count_objects(void* objects, int*) {
  return static_cast<int>(static_cast<const Objects*>(objects)->x.rows());
}

/// A point is known by the rank that gives it and its place there.
void list_objects(void* objects, int, int, ZOLTAN_ID_PTR global, ZOLTAN_ID_PTR local, int, float*,
                  int* error) {
  const auto& [x, rank] = *static_cast<const Objects*>(objects);
  for (unsigned k = 0; k < x.rows(); ++k) {
    *global++ = rank;
    *global++ = *local++ = k;
  }
  *error = ZOLTAN_OK;
}

int count_coordinates(void* objects, int*) {
  return static_cast<int>(static_cast<const Objects*>(objects)->x.cols());
}

void list_coordinates(void* objects, int, int, int count, ZOLTAN_ID_PTR, ZOLTAN_ID_PTR local,
                      int dimension, double* to, int* error) {
  const Positions& x = static_cast<const Objects*>(objects)->x;
  for (int k = 0; k < count; ++k)
    for (int a = 0; a < dimension; ++a) *to++ = x(local[k], a);
  *error = ZOLTAN_OK;
}

/// Who gives each process its points once they are partitioned.
std::vector<PetscSFNode> partitioned(Zoltan_Struct* zoltan, const Positions& x, int rank) {
  Objects objects{x, static_cast<unsigned>(rank)};
  Zoltan_Set_Num_Obj_Fn(zoltan, count_objects, &objects);
  Zoltan_Set_Obj_List_Fn(zoltan, list_objects, &objects);
  Zoltan_Set_Num_Geom_Fn(zoltan, count_coordinates, &objects);
  Zoltan_Set_Geom_Multi_Fn(zoltan, list_coordinates, &objects);
  for (const auto& [name, value] : {std::pair{"DEBUG_LEVEL", "0"},
                                    {"LB_METHOD", "RCB"},
                                    {"KEEP_CUTS", "1"},
                                    {"RETURN_LISTS", "ALL"},
                                    {"NUM_GID_ENTRIES", "2"},
                                    {"NUM_LID_ENTRIES", "1"}})
    check_zoltan(Zoltan_Set_Param(zoltan, name, value));
  int changes, gid, lid, imports, exports, *from, *from_parts, *to, *to_parts;
  ZOLTAN_ID_PTR import_gids, import_lids, export_gids, export_lids;
  check_zoltan(Zoltan_LB_Partition(zoltan, &changes, &gid, &lid, &imports, &import_gids,
                                   &import_lids, &from, &from_parts, &exports, &export_gids,
                                   &export_lids, &to, &to_parts));
  std::vector<char> leaves(x.rows(), false);
  for (int k = 0; k < exports; ++k) leaves[export_lids[k]] = true;
  std::vector<PetscSFNode> givers;
  for (Eigen::Index k = 0; k < x.rows(); ++k)
    if (!leaves[k]) givers.push_back({rank, static_cast<PetscInt>(k)});
  for (int k = 0; k < imports; ++k)
    givers.push_back({from[k], static_cast<PetscInt>(import_lids[k])});
  Zoltan_LB_Free_Part(&import_gids, &import_lids, &from, &from_parts);
  Zoltan_LB_Free_Part(&export_gids, &export_lids, &to, &to_parts);
  // The caller's order.
  std::ranges::sort(givers, {}, [](const PetscSFNode& n) { return std::pair(n.rank, n.index); });
  return givers;
}

}  // namespace

Positions in_box(const Cloud& cloud) {
  Positions x = cloud.positions();
  for (int a = 0; a < cloud.dimension(); ++a)
    if (const double length = cloud.box()[a]; length > 0)
      for (Eigen::Index i = 0; i < x.rows(); ++i) {
        const double y = x(i, a) - length * std::floor(x(i, a) / length);
        x(i, a) = y < length ? std::max(y, 0.0) : 0;
      }
  return x;
}

void check_row_count(MPI_Comm comm, Eigen::Index rows, Eigen::Index wanted) {
  together(comm, [&] {
    if (rows != wanted)
      throw InvalidInput("there are values for " + std::to_string(rows) + " points, not " +
                         std::to_string(wanted));
  });
}

Handle<PetscSF> star_forest(MPI_Comm comm, int roots, const std::vector<PetscInt>* places,
                            const std::vector<PetscSFNode>& leaves) {
  PetscSF sf;
  check(PetscSFCreate(comm, &sf));
  Handle<PetscSF> result(sf);
  check(PetscSFSetGraph(sf, roots, static_cast<PetscInt>(leaves.size()),
                        places ? const_cast<PetscInt*>(places->data()) : nullptr, PETSC_COPY_VALUES,
                        const_cast<PetscSFNode*>(leaves.data()), PETSC_COPY_VALUES));
  check(PetscSFSetUp(sf));
  return result;
}

void Destroy::operator()(Mat object) const { MatDestroy(&object); }
void Destroy::operator()(Vec object) const { VecDestroy(&object); }
void Destroy::operator()(KSP object) const { KSPDestroy(&object); }
void Destroy::operator()(PetscSF object) const { PetscSFDestroy(&object); }
void Destroy::operator()(Zoltan_Struct* object) const { Zoltan_Destroy(&object); }

Partition::Partition(MPI_Comm comm, const Cloud& given)
    : comm_(comm), cloud_(Positions(0, given.dimension())) {
  check_agreement(comm, given);
  size_ = sum_of(comm, std::int64_t{given.size()});
  largest_ = largest_of(comm, given.size() > 0 ? given.positions().cwiseAbs().maxCoeff() : 0.0);
  if (size_ > PETSC_MAX_INT)
    throw InvalidInput(std::to_string(size_) +
                       " points are more than the indices of this PETSc can count; there is a "
                       "PETSc with 64-bit indices");
  distribute(given);
}

void Partition::distribute(const Cloud& given) {
  const int rank = rank_of(comm_), d = given.dimension();
  std::vector<PetscSFNode> givers;
  low_.fill(-DBL_MAX);
  high_.fill(DBL_MAX);
  if (processes(comm_) > 1 && size_ > 0) {
    float version;
    check_zoltan(Zoltan_Initialize(0, nullptr, &version));
    zoltan_.reset(Zoltan_Create(comm_));
    if (!zoltan_) throw std::bad_alloc();
    givers = partitioned(zoltan_.get(), in_box(given), rank);
    int dimension;
    check_zoltan(Zoltan_RCB_Box(zoltan_.get(), rank, &dimension, &low_[0], &low_[1], &low_[2],
                                &high_[0], &high_[1], &high_[2]));
  } else {
    for (int k = 0; k < given.size(); ++k) givers.push_back({rank, k});
  }
  for (int a = 0; a < d; ++a)  // beyond a periodic box there are images, of whichever process
    if (const double length = given.box()[a]; length > 0) {
      low_[a] = std::max(low_[a], 0.0);
      high_[a] = std::min(high_[a], length);
    }

  const int count = static_cast<int>(givers.size());
  const auto given_by = gathered(comm_, std::int64_t{given.size()});
  std::vector<std::int64_t> first(given_by.size());  // of each process
  std::exclusive_scan(given_by.begin(), given_by.end(), first.begin(), std::int64_t{0});
  CloudOptions options{.box = given.box()};
  for (const PetscSFNode& giver : givers)
    options.numbers.push_back(first[giver.rank] + giver.index);
  first_ = static_cast<PetscInt>(sum_before(comm_, std::int64_t{count}));

  from_givers_ = star_forest(comm_, given.size(), nullptr, givers);
  const Positions x = to_owners(given.positions());
  if (anywhere(comm_, given.has_volumes())) options.volumes = to_owners(given.volumes());
  cloud_ = Cloud(x, std::move(options));
}

DenseMatrix Partition::to_owners(const MatrixView& of_given) const {
  PetscInt roots, leaves;
  check(PetscSFGetGraph(from_givers_.get(), &roots, &leaves, nullptr, nullptr));
  check_row_count(comm_, of_given.rows(), roots);
  DenseMatrix result(leaves, of_given.cols());
  for (Eigen::Index c = 0; c < of_given.cols(); ++c) {
    const double* const from = of_given.col(c).data();
    check(
        PetscSFBcastBegin(from_givers_.get(), MPI_DOUBLE, from, result.col(c).data(), MPI_REPLACE));
    check(PetscSFBcastEnd(from_givers_.get(), MPI_DOUBLE, from, result.col(c).data(), MPI_REPLACE));
  }
  return result;
}

DenseMatrix Partition::to_givers(const MatrixView& of_own) const {
  PetscInt roots, leaves;
  check(PetscSFGetGraph(from_givers_.get(), &roots, &leaves, nullptr, nullptr));
  check_row_count(comm_, of_own.rows(), leaves);
  DenseMatrix result(roots, of_own.cols());
  for (Eigen::Index c = 0; c < of_own.cols(); ++c) {
    const double* const from = of_own.col(c).data();
    check(PetscSFReduceBegin(from_givers_.get(), MPI_DOUBLE, from, result.col(c).data(),
                             MPI_REPLACE));
    check(
        PetscSFReduceEnd(from_givers_.get(), MPI_DOUBLE, from, result.col(c).data(), MPI_REPLACE));
  }
  return result;
}

bool Partition::is_inside(const double* low, const double* high) const {
  for (int a = 0; a < cloud_.dimension(); ++a)
    if (!(low[a] > low_[a] && high[a] < high_[a])) return false;
  return true;
}

void Partition::owners_of(const double* low, const double* high, std::vector<int>& ranks) const {
  ranks.clear();
  if (!zoltan_) return;
  std::array<double, 6> box = {};
  for (int a = 0; a < cloud_.dimension(); ++a) box[a] = low[a], box[3 + a] = high[a];
  int count, parts;
  ranks.resize(processes(comm_));
  check_zoltan(Zoltan_LB_Box_PP_Assign(zoltan_.get(), box[0], box[1], box[2], box[3], box[4],
                                       box[5], ranks.data(), &count, nullptr, &parts));
  ranks.resize(count);
  std::erase(ranks, rank_of(comm_));
}

}  // namespace gradpsi::petsc
