#pragma once

#include <petscksp.h>
#include <petscsf.h>

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <type_traits>
#include <vector>

#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"

struct Zoltan_Struct;

#pragma GCC visibility push(default)
namespace gradpsi::petsc {

/// Lets go of PETSc's and Zoltan's objects.
struct Destroy {
  void operator()(Mat) const;             ///< MatDestroy()
  void operator()(Vec) const;             ///< VecDestroy()
  void operator()(KSP) const;             ///< KSPDestroy()
  void operator()(PetscSF) const;         ///< PetscSFDestroy()
  void operator()(Zoltan_Struct*) const;  ///< Zoltan_Destroy()
};
/// Owns an object of PETSc: Handle<Mat>.
template <class Object>
using Handle = std::unique_ptr<std::remove_pointer_t<Object>, Destroy>;

/// Calls work() in every process, which must not communicate. If it throws in any, all throw what the lowest
/// of those ranks did (InvalidInput, StencilError, SolverError, std::bad_alloc, else std::runtime_error), with
/// its rank in the message unless all threw the same. StencilError::point is then of that rank; the
/// message has its number in the whole cloud, and counts that rank's rows.
void together(MPI_Comm comm, const std::function<void()>& work);

struct HaloSearch;

/// Points spread over processes: each owns as many as any other, give or take one, in a box of its own
/// (recursive coordinate bisection by Zoltan).
class Partition {
 public:
  /// @param comm   its processes hold the points between them
  /// @param given  this process's points in the caller's order: those of rank 0 come first. The number of
  ///   a point, for messages, is its place in that order
  /// @throws InvalidInput  if the processes' clouds do not agree in dimension, box or having volumes; if
  ///   there are more points than PETSc's indices can count
  Partition(MPI_Comm comm, const Cloud& given);

  MPI_Comm comm() const { return comm_; }        ///< as given
  std::int64_t size() const { return size_; }    ///< the number of points in all processes
  const Cloud& cloud() const { return cloud_; }  ///< this process's own points, by ascending number
  PetscInt first() const { return first_; }      ///< own points of the ranks before this one

  /// Brings values of the points as given to where they are owned, and back again.
  /// @param of_given  a row for each point given, k columns
  DenseMatrix to_owners(const MatrixView& of_given) const;
  /// @param of_own  a row for each own point, k columns
  DenseMatrix to_givers(const MatrixView& of_own) const;

 private:
  friend struct HaloSearch;
  void distribute(const Cloud& given);
  /// The other ranks whose boxes meet one given by its corners, d numbers each.
  void owners_of(const double* low, const double* high, std::vector<int>& ranks) const;
  /// Whether no box but this process's meets that one.
  bool is_inside(const double* low, const double* high) const;

  MPI_Comm comm_;
  std::int64_t size_ = 0;
  double largest_ = 0;  // magnitude of all coordinates, which are rounded accordingly
  PetscInt first_ = 0;
  Cloud cloud_;
  Handle<PetscSF> from_givers_;
  Handle<Zoltan_Struct*> zoltan_;               // none in a single process
  std::array<double, 3> low_ = {}, high_ = {};  // of this process's box
};

/// A process's own points and, around them, those of others within reach: the halo.
class Subdomain {
 public:
  /// @param partition  must outlive the subdomain
  /// @param reach      lengths >= 0, one for all or one for each own point: other processes' points within
  ///   it of the own one become part of the halo. The support times reach(scheme), and times `widest` where rows may
  ///   be widened
  /// @throws InvalidInput  if sizes disagree or a reach is out of range
  Subdomain(const Partition& partition, const VectorView& reach);

  const Partition& partition() const { return *partition_; }  ///< as given
  /// Own points and halo, n of them, by ascending number.
  const Cloud& cloud() const { return cloud_; }
  /// The own points among them, m of them.
  const std::vector<int>& own() const { return own_; }
  /// How far the halo reaches around the k-th own point.
  double reach(int k) const { return reach_[reach_.size() == 1 ? 0 : k]; }
  /// The number of ranks whose points are in the halo.
  int sources() const { return sources_; }

  /// Gets the halo's values from their owners.
  /// @param of_own  m rows, k columns
  /// @return n rows: of all of cloud()
  DenseMatrix spread(const MatrixView& of_own) const;
  /// The same of whole numbers.
  std::vector<PetscInt> spread(const std::vector<PetscInt>& of_own) const;

 private:
  template <class T>
  void spread(MPI_Datatype type, const T* of_own, T* of_all) const;

  const Partition* partition_;
  DenseVector reach_;
  Cloud cloud_;
  std::vector<int> own_;
  int sources_ = 0;
  Handle<PetscSF> from_owners_;
};

}  // namespace gradpsi::petsc
#pragma GCC visibility pop
