#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gradpsi/petsc.hpp"

namespace gradpsi::petsc {

/// Whether PETSc's database of options has this one, -pc_type for example.
bool has_option(const char* name);

struct Release {
  void operator()(PC object) const { PCDestroy(&object); }
  void operator()(IS object) const { ISDestroy(&object); }
};
template <class Object>
using Owned = std::unique_ptr<std::remove_pointer_t<Object>, Release>;

/// Neither a diagonal nor a twin knows anything of boundary conditions, and a preconditioner that gets them
/// wrong costs hundreds of iterations: their rows are factorised among themselves and correct what another
/// preconditioner has done.
class WallCorrection {
 public:
  /// @param walls  among this process's rows
  WallCorrection(MPI_Comm comm, Mat A, const std::vector<int>& walls);

  /// Makes z meet the boundary conditions, given the residuals r.
  void correct(Vec r, Vec z) const;

 private:
  Handle<Mat> rows_, among_;
  Handle<Vec> residual_, correction_;
  Handle<PetscSF> scatter_;
  Handle<KSP> ksp_;  // none if the rows are singular
};

/// What a solver is chosen by.
struct Traits {
  bool dominant, multigrid;
  double ratio;  // dt nu / dx^2
  int dimension;
};

/// A x = b, solved by PETSc; what gradpsi::LinearSolver is on one machine.
class Solver {
 public:
  /// @param twin     what multigrid is made of, or null: A itself
  /// @param volumes  of the rows' points
  /// @param walls    rows with a boundary condition
  /// @throws InvalidInput, SolverError  as gradpsi::LinearSolver
  Solver(MPI_Comm comm, Handle<Mat> A, Handle<Mat> twin, const Eigen::VectorXd& volumes,
         const std::vector<int>& walls, const Traits& traits, const SolverOptions& options);
  Solver(const Solver&) = delete;  // a preconditioner points here

  const SolverReport& report() const { return report_; }

  /// y = A x
  void multiply(const Eigen::VectorXd& x, Eigen::VectorXd& y);
  /// x is where iterations start from.
  SolveReport solve(const Eigen::VectorXd& b, Eigen::VectorXd& x);

 private:
  struct Sizes {
    double residual, b;
  };

  void set_up(const std::vector<int>& walls, const Traits& traits);
  void set_up_krylov(const std::vector<int>& walls, const Traits& traits,
                     const std::string& reason);
  PC corrected_at_walls(PC outer, const std::vector<int>& walls);
  void factorise(Method method, const std::string& reason);
  PC new_solver(KSPType type);
  void finish(Method method, const std::string& reason);
  void describe(Method method, const std::string& reason);

  void start(const Eigen::VectorXd& b, const Eigen::VectorXd& x, int unit);
  bool iterate(SolveReport& result, int limit);
  int advance(double tolerance, int limit);
  Sizes sizes();
  double size_of_terms();

  MPI_Comm comm_;
  Handle<Mat> A_, twin_;
  SolverOptions options_;
  Eigen::VectorXd scale_;  // of rows: the points' volumes if that makes A symmetric, or 1
  bool symmetric_ = false, fallback_ = false;
  Handle<Vec> b_, x_, r_;
  std::optional<WallCorrection> walls_;
  Owned<PC> inner_;  // what that corrects
  Handle<KSP> ksp_;
  SolverReport report_;
};

}  // namespace gradpsi::petsc
