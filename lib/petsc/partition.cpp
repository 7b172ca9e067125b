#include <zoltan.h>

#include <algorithm>
#include <cfloat>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>

#include "gradpsi/error.hpp"
#include "gradpsi/petsc.hpp"
#include "petsc/collective.hpp"

namespace gradpsi::petsc {
namespace {

void check_zoltan(int code) {
  if (code == ZOLTAN_MEMERR) throw std::bad_alloc();
  if (code == ZOLTAN_FATAL) throw std::runtime_error("Zoltan could not partition the points");
}

/// The images in the box of a periodic cloud's points: where they are looked for.
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

/// Throws unless there is a row of values for each of `wanted` points.
void check_rows(MPI_Comm comm, Eigen::Index rows, Eigen::Index wanted) {
  together(comm, [&] {
    if (rows != wanted)
      throw InvalidInput("there are values for " + std::to_string(rows) + " points, not " +
                         std::to_string(wanted));
  });
}

/// A star forest: leaf k, at places[k] or k, is element indices[k] of process ranks[k], which has `roots`.
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

Eigen::MatrixXd Partition::to_owners(const Eigen::MatrixXd& of_given) const {
  PetscInt roots, leaves;
  check(PetscSFGetGraph(from_givers_.get(), &roots, &leaves, nullptr, nullptr));
  check_rows(comm_, of_given.rows(), roots);
  Eigen::MatrixXd result(leaves, of_given.cols());
  for (Eigen::Index c = 0; c < of_given.cols(); ++c) {
    const double* const from = of_given.col(c).data();
    check(
        PetscSFBcastBegin(from_givers_.get(), MPI_DOUBLE, from, result.col(c).data(), MPI_REPLACE));
    check(PetscSFBcastEnd(from_givers_.get(), MPI_DOUBLE, from, result.col(c).data(), MPI_REPLACE));
  }
  return result;
}

Eigen::MatrixXd Partition::to_givers(const Eigen::MatrixXd& of_own) const {
  PetscInt roots, leaves;
  check(PetscSFGetGraph(from_givers_.get(), &roots, &leaves, nullptr, nullptr));
  check_rows(comm_, of_own.rows(), leaves);
  Eigen::MatrixXd result(roots, of_own.cols());
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

// The halo

namespace {

constexpr double rounding = 4 * DBL_EPSILON;  // of a coordinate and a distance added up

/// A box for each image of the cloud, 3^d of them, of what is looked for: low and high corner.
class Boxes {
 public:
  static int count(int dimension) { return dimension == 1 ? 3 : dimension == 2 ? 9 : 27; }
  static int size(int dimension) { return 2 * dimension * count(dimension); }

  explicit Boxes(int dimension) : d_(dimension), corners_(size(dimension)) {
    for (int b = 0; b < count(d_); ++b)
      for (int a = 0; a < d_; ++a) low(b)[a] = DBL_MAX, high(b)[a] = -DBL_MAX;
  }
  const std::vector<double>& corners() const { return corners_; }

  void extend(int b, const double* from, const double* to) {
    for (int a = 0; a < d_; ++a) {
      low(b)[a] = std::min(low(b)[a], from[a]);
      high(b)[a] = std::max(high(b)[a], to[a]);
    }
  }

 private:
  double* low(int b) { return corners_.data() + std::ptrdiff_t{2} * d_ * b; }
  double* high(int b) { return low(b) + d_; }

  int d_;
  std::vector<double> corners_;
};

}  // namespace

/// What each process asks of others: their points in boxes around its own.
struct HaloSearch {
  static std::map<int, Boxes> requests(const Partition& partition, const Positions& x,
                                       const Eigen::VectorXd& reach);
};

std::map<int, Boxes> HaloSearch::requests(const Partition& partition, const Positions& x,
                                          const Eigen::VectorXd& reach) {
  std::map<int, Boxes> result;
  const Cloud& own = partition.cloud();
  const int d = own.dimension();
  std::vector<int> owners;
  std::array<double, 3> low, high, shifted_low, shifted_high;
  for (int i = 0; i < own.size(); ++i) {
    const double r = reach[reach.size() == 1 ? 0 : i];
    for (int a = 0; a < d; ++a) {
      const double more = r + rounding * (partition.largest_ + own.box()[a] + r);
      low[a] = x(i, a) - more;
      high[a] = x(i, a) + more;
    }
    if (partition.is_inside(low.data(), high.data())) continue;
    for (int image = 0; image < Boxes::count(d); ++image) {
      bool meets = true;
      for (int a = 0, rest = image; a < d; ++a, rest /= 3) {
        const double length = own.box()[a], shift = (rest % 3 - 1) * length;
        shifted_low[a] = low[a] + shift;
        shifted_high[a] = high[a] + shift;
        if (length == 0)
          meets &= rest % 3 == 1;
        else
          meets &= shifted_high[a] >= 0 && shifted_low[a] <= length;
      }
      if (!meets) continue;
      partition.owners_of(shifted_low.data(), shifted_high.data(), owners);
      for (const int q : owners)
        result.try_emplace(q, d).first->second.extend(image, shifted_low.data(),
                                                      shifted_high.data());
    }
  }
  return result;
}

namespace {

/// Own points in one of the boxes that a process asked for: place and number of each.
std::vector<std::int64_t> answer(const Cloud& own, const Positions& x, const double* boxes) {
  const int d = own.dimension();
  std::vector<const double*> asked;  // low corner, then high corner
  for (int b = 0; b < Boxes::count(d); ++b)
    if (const double* const box = boxes + std::ptrdiff_t{2} * d * b; box[0] <= box[d])
      asked.push_back(box);
  std::vector<std::int64_t> found;
  for (int i = 0; i < own.size(); ++i)
    for (const double* const box : asked) {
      bool in = true;
      for (int a = 0; a < d; ++a) in &= box[a] <= x(i, a) && x(i, a) <= box[d + a];
      if (!in) continue;
      found.push_back(i);
      found.push_back(own.number(i));
      break;
    }
  return found;
}

/// A point of the halo.
struct Outsider {
  std::int64_t number;
  PetscSFNode owner;
};

/// Asks the owners of what is around.
std::vector<Outsider> halo(const Partition& partition, const Positions& x,
                           const Eigen::VectorXd& reach) {
  MPI_Comm comm;
  PetscMPIInt tag;
  check(PetscCommDuplicate(partition.comm(), &comm, &tag));
  std::vector<PetscMPIInt> to;
  std::vector<double> boxes;
  std::map<int, Boxes> asks;
  together(comm, [&] { asks = HaloSearch::requests(partition, x, reach); });
  for (const auto& [rank, asked] : asks) {
    to.push_back(rank);
    boxes.insert(boxes.end(), asked.corners().begin(), asked.corners().end());
  }
  const int size = Boxes::size(partition.cloud().dimension());
  PetscMPIInt askers, *asker_ranks;
  double* asked;
  check(PetscCommBuildTwoSided(comm, size, MPI_DOUBLE, static_cast<PetscMPIInt>(to.size()),
                               to.data(), boxes.data(), &askers, &asker_ranks, &asked));
  std::vector<std::vector<std::int64_t>> answers;
  std::vector<MPI_Request> sent(askers);
  for (int k = 0; k < askers; ++k) {
    answers.push_back(answer(partition.cloud(), x, asked + std::ptrdiff_t{size} * k));
    MPI_Isend(answers[k].data(), static_cast<int>(answers[k].size()), MPI_INT64_T, asker_ranks[k],
              tag, comm, &sent[k]);
  }
  std::vector<Outsider> result;
  for (const int q : to) {
    MPI_Status status;
    MPI_Probe(q, tag, comm, &status);
    int count;
    MPI_Get_count(&status, MPI_INT64_T, &count);
    std::vector<std::int64_t> got(count);
    MPI_Recv(got.data(), count, MPI_INT64_T, q, tag, comm, MPI_STATUS_IGNORE);
    for (int k = 0; k < count; k += 2)
      result.push_back({got[k + 1], {q, static_cast<PetscInt>(got[k])}});
  }
  MPI_Waitall(askers, sent.data(), MPI_STATUSES_IGNORE);
  check(PetscFree(asker_ranks));
  check(PetscFree(asked));
  check(PetscCommDestroy(&comm));
  std::ranges::sort(result, {}, &Outsider::number);
  return result;
}

void check_reach(const Partition& partition, const Eigen::VectorXd& reach) {
  if (reach.size() != 1 && reach.size() != partition.cloud().size())
    throw InvalidInput("there are " + std::to_string(reach.size()) + " reaches for " +
                       std::to_string(partition.cloud().size()) + " points");
  for (const double r : reach)
    if (!(r >= 0)) throw InvalidInput("a reach must be >= 0, not " + std::to_string(r));
}

}  // namespace

Subdomain::Subdomain(const Partition& partition, const Eigen::VectorXd& reach)
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

Eigen::MatrixXd Subdomain::spread(const Eigen::MatrixXd& of_own) const {
  check_rows(partition_->comm(), of_own.rows(), std::ssize(own_));
  Eigen::MatrixXd result(cloud_.size(), of_own.cols());
  for (Eigen::Index c = 0; c < of_own.cols(); ++c)
    spread(MPI_DOUBLE, of_own.col(c).data(), result.col(c).data());
  return result;
}

std::vector<PetscInt> Subdomain::spread(const std::vector<PetscInt>& of_own) const {
  check_rows(partition_->comm(), std::ssize(of_own), std::ssize(own_));
  std::vector<PetscInt> result(cloud_.size());
  spread(MPIU_INT, of_own.data(), result.data());
  return result;
}

}  // namespace gradpsi::petsc
