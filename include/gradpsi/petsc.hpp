#pragma once

#include <memory>
#include <vector>

#include "gradpsi/assemble.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/diffusion.hpp"
#include "gradpsi/neighbours.hpp"
#include "gradpsi/petsc_partition.hpp"

/// The same operators on a cloud that is spread over the processes of an MPI communicator: component
/// gradpsi::petsc. PETSc must be initialised. All functions are collective: every process calls them in the
/// same order. Where one process meets an error, all throw it: see together().
///
/// Matrices have the entries that assemble() gives on one machine, to the bit, whatever the number of
/// processes.
#pragma GCC visibility push(default)
namespace gradpsi::petsc {

/// The median of the values of all processes, at least one; infinity counts as a value.
double median(MPI_Comm comm, const VectorView& values);

/// Cloud::spacing() of the whole cloud, to the bit.
/// @throws InvalidInput  as that
double spacing(const Partition& partition, int threads = 0);

/// This process's own points that coincide with one of a lower number, by their places among own points,
/// ascending.
std::vector<int> coincident_points(const Partition& partition);

/// The neighbours of own points, among cloud() of the subdomain; the halo's lists are empty.
/// @param mine      own points and halo
/// @param supports  one for all or one for each own point, at most the subdomain's reach
/// @param threads   0: as many as OpenMP offers
/// @throws InvalidInput  as gradpsi::find_neighbours(), counting all processes' points; if a support
///   exceeds the reach
Neighbours find_neighbours(const Subdomain& mine, const VectorView& supports, int threads = 0);

/// The rows of own points, of `options.rows` those (places in cloud() of own ones), columns being the places
/// in cloud(). Without volumes in the cloud, number densities are taken, the halo's from their owners.
/// @throws as gradpsi::assemble(); InvalidInput if rows may be widened beyond the subdomain's reach
Operator assemble(const Scheme& scheme, const Subdomain& mine, const Neighbours& near,
                  const AssemblyOptions& options = {});

/// gradpsi::with_conductivity(), given kappa of own points.
Operator with_conductivity(Operator laplacian, const Subdomain& mine,
                           const VectorView& conductivity, Mean mean = Mean::Arithmetic);

/// The matrices of an operator that has the rows of all own points, as PETSc's MATMPIAIJ, exactly
/// preallocated. Rows and columns of rank r's own points come after those of the ranks before it:
/// Partition::first() is the first row, and own points ascend.
/// @throws InvalidInput  if other rows were assembled
std::vector<Handle<Mat>> matrices(const Subdomain& mine, const Operator& op);

/// gradpsi::ImplicitDiffusion on PETSc's matrices and solvers.
///
/// Method::Auto takes conjugate gradients if the matrix is symmetric after scaling by volume and diagonally
/// dominant, else BiCGSTAB, preconditioned by the diagonal while steps are short and by multigrid on the points
/// beyond; Method::Cholesky and Method::Lu are MUMPS's. Options of PETSc's database go before what Auto and Krylov
/// choose (-ksp_type, -pc_type, ..), -ksp_rtol and -ksp_max_it before the solver's tolerance and
/// max_iterations. If what Auto chose does not converge in 1,000 iterations (100 with multigrid), LU takes over,
/// unless -ksp_type or -pc_type was given.
class ImplicitDiffusion {
 public:
  /// @param mine        own points and halo, which must outlive this
  /// @param laplacian   rows of all own points, in order; moved in, its memory is free as soon as can be
  /// @param conditions  of own points, by their places in mine.cloud()
  /// @param options     source: a value for each own point; solver.memory: of all processes'
  ///   factors together, 0: no limit
  /// @throws InvalidInput, SolverError  as gradpsi::ImplicitDiffusion
  ImplicitDiffusion(const Subdomain& mine, Operator laplacian, const BoundaryConditions& conditions,
                    const DiffusionOptions& options);
  /// What was moved from can only be destroyed.
  ImplicitDiffusion(ImplicitDiffusion&&) noexcept;
  ~ImplicitDiffusion();

  /// Replaces u of own points at one time by u at the next.
  /// @throws InvalidInput, SolverError  as gradpsi::ImplicitDiffusion::step()
  SolveReport step(Eigen::Ref<Eigen::VectorXd> u);

  /// @throws InvalidInput, SolverError  as gradpsi::ImplicitDiffusion::damped_step(), which this is
  SolveReport damped_step(Eigen::Ref<Eigen::VectorXd> u);

  /// What the system is solved with, and why.
  const SolverReport& solver() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace gradpsi::petsc
#pragma GCC visibility pop
