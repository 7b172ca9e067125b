#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "petsc/multigrid.hpp"
#include "petsc/walls.hpp"
#include "solve/choice.hpp"

namespace gradpsi::petsc {

/// A system whose rows are spread over processes.
struct SpreadSystem {
  Handle<Mat> A;
  Handle<Mat> twin = {};                 // what BoomerAMG is made of; null: A itself
  std::optional<RowLevels> levels = {};  // multigrid's on the points, if it is to be used
  DenseVector volumes;                   // of this process's rows' points
  std::vector<int> walls;                // those of its rows that hold a boundary condition
  Traits traits;                         // of the whole
};

/// A x = b, solved by PETSc; what gradpsi::LinearSolver is on one machine.
class Solver {
 public:
  /// @throws SolverError  as gradpsi::LinearSolver
  Solver(MPI_Comm comm, SpreadSystem system, const Choice& choice, const SolverOptions& options);
  Solver(const Solver&) = delete;  // a preconditioner points here

  const SolverReport& report() const { return report_; }

  /// y = A x
  void multiply(const VectorView& x, DenseVector& y);
  /// x is where iterations start from.
  SolveReport solve(const VectorView& b, DenseVector& x);

 private:
  struct Sizes {
    double residual, b;
  };

  void set_up_krylov(SpreadSystem& system);
  PC corrected_at_walls(PC outer, const std::vector<int>& walls);
  void set_shell(PC pc, std::function<void(Vec, Vec)> apply);
  void factorise();
  PC new_solver(KSPType type);
  void finish();
  void describe();

  void start(const VectorView& b, const VectorView& x, int unit);
  bool iterate(SolveReport& result, int limit);
  int advance(double tolerance, int limit);
  Sizes sizes();
  double size_of_terms();

  MPI_Comm comm_;
  Handle<Mat> A_, twin_;
  SolverOptions options_;
  Choice choice_;
  DenseVector scale_;  // of rows: the points' volumes if that makes A symmetric, or 1
  Handle<Vec> b_, x_, r_;
  std::optional<Multigrid> multigrid_;
  std::optional<WallCorrection> walls_;
  Owned<PC> inner_;                      // what that corrects
  std::function<void(Vec, Vec)> apply_;  // z = about A^-1 r
  Handle<KSP> ksp_;
  SolverReport report_;
};

}  // namespace gradpsi::petsc
