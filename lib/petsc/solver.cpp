#include "petsc/solver.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "base/stopwatch.hpp"
#include "base/text.hpp"
#include "gradpsi/error.hpp"
#include "petsc/collective.hpp"
#include "solve/errors.hpp"

namespace gradpsi::petsc {
namespace {

/// Options of BoomerAMG for rows that are longer than those of finite elements, of which its defaults make dense
/// ones: with them it takes a third of the time in three dimensions. The last is for these only.
using Option = std::pair<const char*, const char*>;
constexpr std::array<Option, 4> for_long_rows = {{{"-pc_hypre_boomeramg_coarsen_type", "HMIS"},
                                                  {"-pc_hypre_boomeramg_interp_type", "ext+i"},
                                                  {"-pc_hypre_boomeramg_P_max", "4"},
                                                  {"-pc_hypre_boomeramg_agg_nl", "1"}}};

Handle<Vec> vector_like(Mat A) {
  Vec v;
  check(MatCreateVecs(A, nullptr, &v));
  return Handle<Vec>(v);
}

/// Calls f(k, v_k) for this process's part of a vector, which it may change.
template <class F>
void for_each_entry(Vec v, const F& f) {
  PetscInt count;
  double* values;
  check(VecGetLocalSize(v, &count));
  check(VecGetArray(v, &values));
  for (PetscInt k = 0; k < count; ++k) f(k, values[k]);
  check(VecRestoreArray(v, &values));
}

/// A number from -1 to 1 for each row.
double noise(std::uint64_t number, std::uint64_t seed) {
  std::uint64_t x = number * 0x9E3779B97F4A7C15u + seed;  // Steele, Lea, Flood: splitmix64
  x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
  x = (x ^ x >> 27) * 0x94D049BB133111EBu;
  return std::ldexp(static_cast<double>((x ^ x >> 31) >> 11), -52) - 1;
}

/// Whether diag(scale) A is symmetric, that is x . scale A y = y . scale A x for two arbitrary vectors:
/// comparing entries would take rows of others.
bool is_symmetric(Mat A, Vec scale) {
  const auto x = vector_like(A), y = vector_like(A), Ax = vector_like(A), Ay = vector_like(A);
  PetscInt first;
  check(VecGetOwnershipRange(x.get(), &first, nullptr));
  for_each_entry(x.get(), [&](PetscInt k, double& v) { v = noise(first + k, 1); });
  for_each_entry(y.get(), [&](PetscInt k, double& v) { v = noise(first + k, 2); });
  check(MatMult(A, x.get(), Ax.get()));
  check(MatMult(A, y.get(), Ay.get()));
  for (const Vec product : {Ax.get(), Ay.get()}) check(VecPointwiseMult(product, scale, product));
  double xAy, yAx, size, norm;
  check(VecDot(x.get(), Ay.get(), &xAy));
  check(VecDot(y.get(), Ax.get(), &yAx));
  check(VecNorm(x.get(), NORM_2, &norm));
  check(VecNorm(Ay.get(), NORM_2, &size));
  return std::abs(xAy - yAx) <= 1e-13 * norm * size;
}

/// Makes entries those of |A|.
void take_magnitudes(Mat A) {
  Mat own, others;
  check(MatMPIAIJGetSeqAIJ(A, &own, &others, nullptr));
  for (const Mat block : {own, others}) {
    MatInfo info;
    double* values;
    check(MatGetInfo(block, MAT_LOCAL, &info));
    check(MatSeqAIJGetArray(block, &values));
    std::transform(values, values + static_cast<std::ptrdiff_t>(info.nz_used), values,
                   [](double a) { return std::abs(a); });
    check(MatSeqAIJRestoreArray(block, &values));
  }
}

/// Options that are in PETSc's database for a while, unless the user has set them.
class Defaults {
 public:
  explicit Defaults(std::span<const Option> options) {
    for (const auto& [name, value] : options) {
      if (has_option(name)) continue;
      check(PetscOptionsSetValue(nullptr, name, value));
      set_.push_back(name);
    }
  }
  Defaults(const Defaults&) = delete;
  ~Defaults() {
    for (const char* name : set_) PetscOptionsClearValue(nullptr, name);
  }

 private:
  std::vector<const char*> set_;
};

Handle<Mat> part_of(Mat A, IS rows, IS columns) {
  Mat part;
  check(MatCreateSubMatrix(A, rows, columns, MAT_INITIAL_MATRIX, &part));
  return Handle<Mat>(part);
}

/// Whether a preconditioner's set-up failed in any process, and why.
enum class Failed { No, Singular, Memory };
Failed failure_of(MPI_Comm comm, PC pc) {
  PCFailedReason reason;
  check(PCGetFailedReasonRank(pc, &reason));
  auto failed = reason == PC_NOERROR            ? Failed::No
                : reason == PC_FACTOR_OUTMEMORY ? Failed::Memory
                                                : Failed::Singular;
  MatSolverType solver;
  check(PCFactorGetMatSolverType(pc, &solver));
  if (failed == Failed::Singular && solver && std::string(solver) == MATSOLVERMUMPS) {
    Mat factor;
    PetscInt error;
    check(PCFactorGetMatrix(pc, &factor));
    check(MatMumpsGetInfog(factor, 1, &error));
    // MUMPS's user guide, section 8: these are what it calls a lack of memory.
    const auto lacks = {-7, -8, -9, -11, -13, -14, -15, -17, -18, -19, -20};
    if (std::ranges::find(lacks, error) != lacks.end()) failed = Failed::Memory;
  }
  return static_cast<Failed>(largest_of(comm, static_cast<int>(failed)));
}

/// MUMPS's factors as a preconditioner. `memory`: bytes for all processes, 0: as many as it takes.
void set_mumps(MPI_Comm comm, PC pc, bool cholesky, double memory) {
  Mat factor;
  check(PCSetType(pc, cholesky ? PCCHOLESKY : PCLU));
  check(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  check(PCFactorSetUpMatSolverType(pc));
  check(PCFactorGetMatrix(pc, &factor));
  // Per cent more workspace than estimated: the usual 20 can be too few.
  check(MatMumpsSetIcntl(factor, 14, 100));
  const double megabytes = memory / processes(comm) / 1e6;
  if (memory == 0 || megabytes > 1e6) return;  // more than any process has
  check(MatMumpsSetIcntl(factor, 23, std::max(1, static_cast<int>(megabytes))));
}

}  // namespace

bool has_option(const char* name) {
  PetscBool there;
  check(PetscOptionsHasName(nullptr, nullptr, name, &there));
  return there == PETSC_TRUE;
}

WallCorrection::WallCorrection(MPI_Comm comm, Mat A, const std::vector<int>& walls) {
  PetscInt first, end;
  check(MatGetOwnershipRange(A, &first, &end));
  std::vector<PetscInt> numbers;
  for (const int k : walls) numbers.push_back(first + k);
  std::ranges::sort(numbers);
  IS set;
  check(ISCreateGeneral(comm, static_cast<PetscInt>(numbers.size()), numbers.data(),
                        PETSC_COPY_VALUES, &set));
  const Owned<IS> rows(set);
  check(ISCreateStride(comm, end - first, first, 1, &set));
  const Owned<IS> all(set);
  rows_ = part_of(A, rows.get(), all.get());
  among_ = part_of(A, rows.get(), rows.get());
  Vec b, x;
  check(MatCreateVecs(among_.get(), &x, &b));
  residual_.reset(b);
  correction_.reset(x);
  const auto full = vector_like(A);
  VecScatter scatter;
  check(VecScatterCreate(full.get(), rows.get(), b, nullptr, &scatter));
  scatter_.reset(scatter);
  KSP ksp;
  PC pc;
  check(KSPCreate(comm, &ksp));
  ksp_.reset(ksp);
  check(KSPSetOperators(ksp, among_.get(), among_.get()));
  check(KSPSetType(ksp, KSPPREONLY));
  check(KSPGetPC(ksp, &pc));
  set_mumps(comm, pc, false, 0);
  check(KSPSetUp(ksp));
  if (failure_of(comm, pc) != Failed::No) ksp_.reset();  // singular: without, then
}

void WallCorrection::correct(Vec r, Vec z) const {
  if (!ksp_) return;
  check(MatMult(rows_.get(), z, residual_.get()));
  check(VecScale(residual_.get(), -1));
  check(VecScatterBegin(scatter_.get(), r, residual_.get(), ADD_VALUES, SCATTER_FORWARD));
  check(VecScatterEnd(scatter_.get(), r, residual_.get(), ADD_VALUES, SCATTER_FORWARD));
  check(KSPSolve(ksp_.get(), residual_.get(), correction_.get()));
  check(VecScatterBegin(scatter_.get(), correction_.get(), z, ADD_VALUES, SCATTER_REVERSE));
  check(VecScatterEnd(scatter_.get(), correction_.get(), z, ADD_VALUES, SCATTER_REVERSE));
}

Solver::Solver(MPI_Comm comm, Handle<Mat> A, Handle<Mat> twin, const Eigen::VectorXd& volumes,
               const std::vector<int>& walls, const Traits& traits, const SolverOptions& options)
    : comm_(comm),
      A_(std::move(A)),
      twin_(std::move(twin)),
      options_(options),
      scale_(Eigen::VectorXd::Ones(volumes.size())) {
  const auto v = vector_like(A_.get());
  for_each_entry(v.get(), [&](PetscInt k, double& x) { x = volumes[k]; });
  symmetric_ = is_symmetric(A_.get(), v.get());
  if (symmetric_) {
    scale_ = volumes;
    check(MatDiagonalScale(A_.get(), v.get(), nullptr));
    if (twin_) check(MatDiagonalScale(twin_.get(), v.get(), nullptr));
  }
  b_ = vector_like(A_.get());
  x_ = vector_like(A_.get());
  r_ = vector_like(A_.get());
  set_up(walls, traits);
}

void Solver::multiply(const Eigen::VectorXd& x, Eigen::VectorXd& y) {
  for_each_entry(x_.get(), [&](PetscInt k, double& v) { v = x[k]; });
  check(MatMult(A_.get(), x_.get(), r_.get()));
  for_each_entry(r_.get(), [&](PetscInt k, double& v) { y[k] = v / scale_[k]; });
}

/// Puts b and x in their vectors, in units of a power of 2.
void Solver::start(const Eigen::VectorXd& b, const Eigen::VectorXd& x, int unit) {
  bool finite = true;
  for_each_entry(b_.get(), [&](PetscInt k, double& v) { v = scale_[k] * std::ldexp(b[k], -unit); });
  for_each_entry(x_.get(), [&](PetscInt k, double& v) {
    v = std::ldexp(x[k], -unit);
    finite &= std::isfinite(v);
  });
  if (anywhere(comm_, !finite)) check(VecSet(x_.get(), 0));  // a start that far off is none
}

SolveReport Solver::solve(const Eigen::VectorXd& b, Eigen::VectorXd& x) {
  Stopwatch watch;
  SolveReport result;
  // In units in which b is about 1 its square neither overflows nor vanishes.
  const double largest = largest_of(comm_, b.size() > 0 ? b.cwiseAbs().maxCoeff() : 0.0);
  if (largest == 0) {
    x.setZero();
    return result;
  }
  const int unit = std::ilogb(largest);
  start(b, x, unit);
  const int most = options_.max_iterations;
  if (!iterate(result, fallback_ ? std::min(most, 1'000) : most)) {
    if (!fallback_) throw unsolved(report_, result);
    result = {};
    factorise(Method::Lu, report_.reason + ", and iterations did not converge");
    start(b, x, unit);
    if (!iterate(result, 3)) throw unsolved(report_, result);
  }
  for_each_entry(x_.get(), [&](PetscInt k, double& v) { x[k] = std::ldexp(v, unit); });
  result.seconds = watch.lap();
  return result;
}

void Solver::set_up(const std::vector<int>& walls, const Traits& traits) {
  const bool chosen = has_option("-ksp_type") || has_option("-pc_type");
  PetscInt unknowns;
  check(MatGetSize(A_.get(), &unknowns, nullptr));
  std::string reason = !symmetric_       ? "the matrix is not symmetric"
                       : traits.dominant ? "the matrix is symmetric"
                                         : "the matrix is symmetric but not diagonally dominant";
  reason += ", of " + std::to_string(unknowns) +
            " unknowns, with dt nu / dx^2 = " + rounded(traits.ratio);
  if (chosen) reason = "as asked by PETSc's options";
  switch (options_.method) {
    case Method::Cholesky:
      if (!symmetric_) throw not_symmetric();
      return factorise(Method::Cholesky, "as asked");
    case Method::Lu: return factorise(Method::Lu, "as asked");
    case Method::Krylov: reason = chosen ? reason : "as asked"; break;
    case Method::Auto: fallback_ = !chosen; break;
  }
  set_up_krylov(walls, traits, reason);
}

void Solver::set_up_krylov(const std::vector<int>& walls, const Traits& traits,
                           const std::string& reason) {
  PC pc = new_solver(symmetric_ && traits.dominant ? KSPCG : KSPBCGS);
  const Defaults defaults(
      std::span<const Option>(for_long_rows).first(traits.dimension == 3 ? 4 : 3));
  if (!has_option("-pc_type") && anywhere(comm_, !walls.empty()))
    pc = corrected_at_walls(pc, walls);
  if (traits.multigrid) {
    check(PCSetType(pc, PCHYPRE));
    check(PCHYPRESetType(pc, "boomeramg"));
  } else {
    check(PCSetType(pc, PCJACOBI));
  }
  if (inner_) {
    check(PCSetFromOptions(pc));
    check(PCSetUp(pc));
  }
  finish(Method::Krylov, reason);
}

/// The preconditioner within one that corrects the rows of walls.
PC Solver::corrected_at_walls(PC outer, const std::vector<int>& walls) {
  walls_.emplace(comm_, A_.get(), walls);
  PC inner;
  check(PCCreate(comm_, &inner));
  inner_.reset(inner);
  check(PCSetOperators(inner, A_.get(), twin_ ? twin_.get() : A_.get()));
  check(PCSetType(outer, PCSHELL));
  check(PCShellSetContext(outer, this));
  check(PCShellSetApply(outer, [](PC shell, Vec r, Vec z) -> PetscErrorCode {
    void* self;
    PetscErrorCode code = PCShellGetContext(shell, &self);
    if (code != 0) return code;
    try {
      const auto& solver = *static_cast<const Solver*>(self);
      check(PCApply(solver.inner_.get(), r, z));
      solver.walls_->correct(r, z);
    } catch (const std::exception&) {
      return PETSC_ERR_LIB;
    }
    return 0;
  }));
  return inner;
}

void Solver::factorise(Method method, const std::string& reason) {
  const bool cholesky = method == Method::Cholesky;
  fallback_ = false;
  twin_.reset();
  const PC pc = new_solver(KSPPREONLY);
  if (cholesky) check(MatSetOption(A_.get(), MAT_SPD, PETSC_TRUE));
  set_mumps(comm_, pc, cholesky, options_.memory);
  finish(method, reason);
  if (!cholesky) return;
  Mat factor;
  PetscInt negative_pivots;
  check(PCFactorGetMatrix(pc, &factor));
  check(MatMumpsGetInfog(factor, 12, &negative_pivots));
  if (negative_pivots > 0) throw indefinite();
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
  return pc;
}

/// Options of the command line go before what was chosen.
void Solver::finish(Method method, const std::string& reason) {
  Stopwatch watch;
  const KSP ksp = ksp_.get();
  check(KSPSetTolerances(ksp, options_.tolerance, PETSC_DEFAULT, 1e30, options_.max_iterations));
  if (method == Method::Krylov) check(KSPSetFromOptions(ksp));
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
    if (method == Method::Cholesky) throw indefinite();
    throw SolverError(solver_name + ": the matrix could not be factorised, it is singular");
  }
  report_.factor.factor_seconds = watch.lap();
  describe(method, reason);
}

void Solver::describe(Method method, const std::string& reason) {
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
  report_.description =
      method == Method::Krylov
          ? words(solver) + " preconditioned by " + words(preconditioner) + where
          : (method == Method::Lu ? "LU" : "Cholesky") + std::string(" by MUMPS") + where;
  report_.reason = reason;
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
  Mat copy;
  check(MatDuplicate(A_.get(), MAT_COPY_VALUES, &copy));
  const Handle<Mat> magnitudes(copy);
  take_magnitudes(copy);
  const auto x = vector_like(copy), terms = vector_like(copy);
  check(VecCopy(x_.get(), x.get()));
  check(VecAbs(x.get()));
  check(MatMult(copy, x.get(), terms.get()));
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
    if (!std::isfinite(norm)) return false;
    if (norm <= options_.tolerance * size) return true;
    if (rounds > 0 && norm <= 1e-4 * size &&
        norm <= 8 * std::numeric_limits<double>::epsilon() * size_of_terms())
      return true;
    if (left <= 0 || rounds == 20 || (done > 0 && !(norm < before / 2))) return false;
    // The solver's own residual, scaled, preconditioned or updated, was small enough: it must become smaller.
    if (rounds > 0) tolerance *= std::min(0.1, options_.tolerance * size / norm);
    before = norm;
    done = advance(tolerance, left);
    left -= std::max(done, 1);
    result.iterations += report_.method == Method::Krylov || rounds > 0 ? done : 0;
  }
}

/// Solves once; by a factor for what r_ still lacks. The iterations that it took.
int Solver::advance(double tolerance, int limit) {
  if (report_.method == Method::Krylov) {
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
