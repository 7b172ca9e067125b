#include "petsc/solver.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "base/stopwatch.hpp"
#include "gradpsi/error.hpp"
#include "petsc/collective.hpp"
#include "petsc/mumps.hpp"
#include "petsc/options.hpp"
#include "petsc/vectors.hpp"
#include "solve/errors.hpp"
#include "solve/for_petsc.hpp"
#include "solve/residual.hpp"

namespace gradpsi::petsc {
namespace {

/// Options of BoomerAMG for rows that are longer than those of finite elements, of which its defaults make dense
/// ones: with them it takes a third of the time in three dimensions. The last is for these only.
constexpr std::array<Option, 4> for_long_rows = {{{"-pc_hypre_boomeramg_coarsen_type", "HMIS"},
                                                  {"-pc_hypre_boomeramg_interp_type", "ext+i"},
                                                  {"-pc_hypre_boomeramg_P_max", "4"},
                                                  {"-pc_hypre_boomeramg_agg_nl", "1"}}};

}  // namespace

Solver::Solver(MPI_Comm comm, SpreadSystem system, const Choice& choice,
               const SolverOptions& options)
    : comm_(comm),
      A_(std::move(system.A)),
      twin_(std::move(system.twin)),
      options_(options),
      choice_(choice),
      scale_(DenseVector::Ones(system.volumes.size())) {
  b_ = vector_like(A_.get());
  x_ = vector_like(A_.get());
  r_ = vector_like(A_.get());
  if (system.traits.symmetric) {
    scale_ = system.volumes;
    for_each_entry(r_.get(), [&](PetscInt k, double& v) { v = scale_[k]; });
    check(MatDiagonalScale(A_.get(), r_.get(), nullptr));
    if (twin_) check(MatDiagonalScale(twin_.get(), r_.get(), nullptr));
  }
  iterates(choice_.method) ? set_up_krylov(system) : factorise();
}

void Solver::multiply(const VectorView& x, DenseVector& y) {
  for_each_entry(x_.get(), [&](PetscInt k, double& v) { v = x[k]; });
  check(MatMult(A_.get(), x_.get(), r_.get()));
  for_each_entry(r_.get(), [&](PetscInt k, double& v) { y[k] = v / scale_[k]; });
}

/// Puts b and x in their vectors, in units of a power of 2.
void Solver::start(const VectorView& b, const VectorView& x, int unit) {
  bool finite = true;
  for_each_entry(b_.get(), [&](PetscInt k, double& v) { v = scale_[k] * std::ldexp(b[k], -unit); });
  for_each_entry(x_.get(), [&](PetscInt k, double& v) {
    v = std::ldexp(x[k], -unit);
    finite &= std::isfinite(v);
  });
  if (anywhere(comm_, !finite)) check(VecSet(x_.get(), 0));  // a start that far off is none
}

SolveReport Solver::solve(const VectorView& b, DenseVector& x) {
  Stopwatch watch;
  SolveReport result;
  const double largest = largest_of(comm_, b.size() > 0 ? b.cwiseAbs().maxCoeff() : 0.0);
  if (largest == 0) {
    x.setZero();
    return result;
  }
  const int unit = unit_of(largest);
  start(b, x, unit);
  if (!iterate(result, most_iterations(choice_, options_))) {
    if (!choice_.provisional) throw unsolved(report_, result);
    result = {};
    choice_ = successor(choice_);
    factorise();
    start(b, x, unit);
    if (!iterate(result, 3)) throw unsolved(report_, result);
  }
  for_each_entry(x_.get(), [&](PetscInt k, double& v) { x[k] = std::ldexp(v, unit); });
  result.seconds = watch.lap();
  return result;
}

void Solver::set_up_krylov(SpreadSystem& system) {
  if (has_option("-ksp_type") || has_option("-pc_type")) {
    choice_.reason = "as asked by PETSc's options";
    choice_.provisional = false;
  }
  PC pc = new_solver(choice_.conjugate ? KSPCG : KSPBCGS);
  if (system.levels) {
    multigrid_.emplace(comm_, A_.get(), std::move(*system.levels), scale_, options_.threads);
    set_shell(pc, [this](Vec r, Vec z) { multigrid_->apply(r, z); });
    return finish();
  }
  const Traits& traits = system.traits;
  const Defaults defaults(
      std::span<const Option>(for_long_rows).first(traits.dimension == 3 ? 4 : 3));
  if (!has_option("-pc_type") && traits.walls) pc = corrected_at_walls(pc, system.walls);
  if (choice_.preconditioner == Preconditioner::Diagonal) {
    check(PCSetType(pc, PCJACOBI));
  } else {
    check(PCSetType(pc, PCHYPRE));
    check(PCHYPRESetType(pc, "boomeramg"));
  }
  if (inner_) {
    check(PCSetFromOptions(pc));
    check(PCSetUp(pc));
  }
  finish();
}

/// The preconditioner within one that corrects the rows of walls.
PC Solver::corrected_at_walls(PC outer, const std::vector<int>& walls) {
  walls_.emplace(comm_, A_.get(), walls);
  PC inner;
  check(PCCreate(comm_, &inner));
  inner_.reset(inner);
  check(PCSetOperators(inner, A_.get(), twin_ ? twin_.get() : A_.get()));
  set_shell(outer, [this](Vec r, Vec z) {
    check(PCApply(inner_.get(), r, z));
    walls_->correct(r, z);
  });
  return inner;
}

void Solver::set_shell(PC pc, std::function<void(Vec, Vec)> apply) {
  apply_ = std::move(apply);
  check(PCSetType(pc, PCSHELL));
  check(PCShellSetContext(pc, this));
  check(PCShellSetApply(pc, [](PC shell, Vec r, Vec z) -> PetscErrorCode {
    void* self;
    if (const PetscErrorCode code = PCShellGetContext(shell, &self); code != 0) return code;
    try {
      static_cast<const Solver*>(self)->apply_(r, z);
    } catch (const std::exception&) {
      return PETSC_ERR_LIB;
    }
    return 0;
  }));
}

void Solver::factorise() {
  const bool cholesky = choice_.method == Method::Cholesky;
  twin_.reset();
  const PC pc = new_solver(KSPPREONLY);
  if (cholesky) check(MatSetOption(A_.get(), MAT_SPD, PETSC_TRUE));
  set_mumps(comm_, pc, cholesky, options_.memory);
  finish();
  if (!cholesky) return;
  Mat factor;
  PetscInt negative_pivots;
  check(PCFactorGetMatrix(pc, &factor));
  check(MatMumpsGetInfog(factor, 12, &negative_pivots));
  if (negative_pivots > 0) throw Indefinite();
}

PC Solver::new_solver(KSPType type) {
  KSP ksp;
  PC pc;
  check(KSPCreate(comm_, &ksp));
  ksp_.reset(ksp);
  check(KSPSetOperators(ksp, A_.get(), twin_ ? twin_.get() : A_.get()));
  check(KSPSetType(ksp, type));
  check(KSPGetPC(ksp, &pc));
  inner_.reset();
  walls_.reset();
  multigrid_.reset();
  return pc;
}

/// Options of the command line go before what was chosen.
void Solver::finish() {
  const Method method = choice_.method;
  Stopwatch watch;
  const KSP ksp = ksp_.get();
  check(KSPSetTolerances(ksp, options_.tolerance, PETSC_DEFAULT, 1e30, options_.max_iterations));
  if (iterates(method)) check(KSPSetFromOptions(ksp));
  PetscInt iterations;
  check(KSPGetTolerances(ksp, &options_.tolerance, nullptr, nullptr, &iterations));
  options_.max_iterations =
      static_cast<int>(std::min<PetscInt>(iterations, std::numeric_limits<int>::max()));
  check_options(options_);  // -ksp_rtol and -ksp_max_it may have changed them
  KSPType type;
  PC pc;
  check(KSPGetType(ksp, &type));
  check(KSPGetPC(ksp, &pc));
  const std::string solver = type;
  if (solver != KSPPREONLY) check(KSPSetInitialGuessNonzero(ksp, PETSC_TRUE));
  if (solver == KSPCG && !has_option("-ksp_norm_type"))
    check(KSPSetNormType(ksp, KSP_NORM_UNPRECONDITIONED));
  if (solver == KSPBCGS && !has_option("-ksp_pc_side")) check(KSPSetPCSide(ksp, PC_RIGHT));
  check(KSPSetUp(ksp));
  if (const Failed failed = failure_of(comm_, pc); failed != Failed::No) {
    const std::string solver_name(name(method));
    if (failed == Failed::Memory)
      throw SolverError(solver_name + ": the factor does not fit the memory; krylov takes little");
    if (method == Method::Cholesky) throw Indefinite();
    throw SolverError(solver_name + ": the matrix could not be factorised, it is singular");
  }
  report_.factor.factor_seconds = watch.lap();
  describe();
}

void Solver::describe() {
  const Method method = choice_.method;
  KSPType solver;
  PCType preconditioner;
  PC pc;
  check(KSPGetType(ksp_.get(), &solver));
  check(KSPGetPC(ksp_.get(), &pc));
  check(PCGetType(inner_ ? inner_.get() : pc, &preconditioner));
  const auto words = [](const std::string& name) -> std::string {
    if (name == KSPCG) return "conjugate gradients";
    if (name == KSPBCGS) return "BiCGSTAB";
    if (name == PCJACOBI) return "the diagonal";
    if (name == PCHYPRE) return "BoomerAMG";
    return name;
  };
  const int count = processes(comm_);
  const std::string where =
      " (PETSc, " + std::to_string(count) + (count > 1 ? " processes)" : " process)");
  report_.method = method;
  report_.iterates = iterates(method);
  report_.description =
      iterates(method)
          ? words(solver) + " preconditioned by " +
                (multigrid_ ? multigrid_->description() : words(preconditioner)) + where
          : (method == Method::Lu ? "LU" : "Cholesky") + std::string(" by MUMPS") + where;
  report_.reason = choice_.reason;
  PetscInt unknowns;
  check(MatGetSize(A_.get(), &unknowns, nullptr));
  report_.unknowns =
      static_cast<int>(std::min<std::int64_t>(unknowns, std::numeric_limits<int>::max()));
}

/// 2-norms of b - A x, which is left in r_, and of b.
Solver::Sizes Solver::sizes() {
  check(MatMult(A_.get(), x_.get(), r_.get()));
  check(VecAYPX(r_.get(), -1, b_.get()));
  double r = 0, b = 0;
  for_each_entry(r_.get(), [&](PetscInt k, double& v) { r += v / scale_[k] * (v / scale_[k]); });
  for_each_entry(b_.get(), [&](PetscInt k, double& v) { b += v / scale_[k] * (v / scale_[k]); });
  return {std::sqrt(sum_of(comm_, r)), std::sqrt(sum_of(comm_, b))};
}

/// 2-norm of |b| + |A| |x|: what rounding is relative to.
double Solver::size_of_terms() {
  const auto terms = vector_like(A_.get());
  multiply_magnitudes(A_.get(), x_.get(), terms.get());
  double sum = 0;
  const double* b;
  check(VecGetArrayRead(b_.get(), &b));
  for_each_entry(terms.get(), [&](PetscInt k, double& v) {
    const double all = (v + std::abs(b[k])) / scale_[k];
    sum += all * all;
  });
  check(VecRestoreArrayRead(b_.get(), &b));
  return std::sqrt(sum_of(comm_, sum));
}

/// Solves, again from the true residual as long as that halves it. Whether the residual is at last below
/// the tolerance, or as small as rounding lets it be.
bool Solver::iterate(SolveReport& result, int limit) {
  double before = std::numeric_limits<double>::infinity(), tolerance = options_.tolerance;
  for (int left = limit, rounds = 0, done = 1;; ++rounds) {
    const auto [norm, size] = sizes();
    result.residual = norm / size;
    // At first without the price of the terms.
    if (is_solved(norm, size, options_.tolerance, [&] { return rounds > 0 ? size_of_terms() : 0; }))
      return true;
    if (!std::isfinite(norm) || left <= 0 || rounds == 20 || (done > 0 && !(norm < before / 2)))
      return false;
    // The solver's own residual, scaled, preconditioned or updated, was small enough: it must become smaller.
    if (rounds > 0) tolerance *= std::min(0.1, options_.tolerance * size / norm);
    before = norm;
    done = advance(tolerance, left);
    left -= std::max(done, 1);
    result.iterations += iterates(report_.method) || rounds > 0 ? done : 0;
  }
}

/// Solves once; by a factor for what r_ still lacks. The iterations that it took.
int Solver::advance(double tolerance, int limit) {
  if (iterates(report_.method)) {
    check(KSPSetTolerances(ksp_.get(), tolerance, PETSC_DEFAULT, PETSC_DEFAULT, limit));
    check(KSPSolve(ksp_.get(), b_.get(), x_.get()));
    PetscInt done;
    check(KSPGetIterationNumber(ksp_.get(), &done));
    return static_cast<int>(done);
  }
  const auto correction = vector_like(A_.get());
  check(KSPSolve(ksp_.get(), r_.get(), correction.get()));
  check(VecAXPY(x_.get(), 1, correction.get()));
  return 1;
}

}  // namespace gradpsi::petsc
