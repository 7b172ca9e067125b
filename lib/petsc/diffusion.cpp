#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <span>
#include <string>

#include "../matrix_checks.hpp"
#include "../sets.hpp"
#include "../stopwatch.hpp"
#include "../text.hpp"
#include "../twin.hpp"
#include "collective.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/petsc.hpp"
#include "matrix.hpp"

namespace gradpsi::petsc {
namespace {

/// Whether multigrid is worth its set-up, by the iterations that the diagonal would take: they grow with a
/// step's reach, sqrt(dt nu), until that is the whole domain. Measured in benchmarks/README.md.
bool needs_multigrid(double ratio, double unknowns, int dimension) {
  const double width = std::pow(unknowns, 1.0 / dimension);
  const double iterations = std::min(10 * std::sqrt(ratio), 1.3 * width);
  return iterations > 60;
}

/// Options of BoomerAMG for rows that are longer than those of finite elements, of which its defaults make dense
/// ones: with them it takes a third of the time in three dimensions. The last is for these only.
using Option = std::pair<const char*, const char*>;
constexpr std::array<Option, 4> for_long_rows = {{{"-pc_hypre_boomeramg_coarsen_type", "HMIS"},
                                                  {"-pc_hypre_boomeramg_interp_type", "ext+i"},
                                                  {"-pc_hypre_boomeramg_P_max", "4"},
                                                  {"-pc_hypre_boomeramg_agg_nl", "1"}}};

/// The place of a subdomain's points among own ones; -1: halo.
std::vector<int> own_places(const Subdomain& mine) {
  std::vector<int> place(mine.cloud().size(), -1);
  for (std::size_t k = 0; k < mine.own().size(); ++k) place[mine.own()[k]] = static_cast<int>(k);
  return place;
}

/// The halo's fixed points added to the own ones.
FixedValues with_halo(const Subdomain& mine, const FixedValues& own) {
  const std::vector<int> place = own_places(mine);
  const bool prescribed = anywhere(mine.partition().comm(), own.values.size() > 0);
  together(mine.partition().comm(), [&] {
    if (prescribed && own.values.size() != std::ssize(own.points))
      throw InvalidInput("fixed.values has " + std::to_string(own.values.size()) + " entries for " +
                         std::to_string(own.points.size()) + " points");
    for (const int i : own.points)
      if (i < 0 || i >= mine.cloud().size() || place[i] < 0)
        throw InvalidInput("there is no own point " + std::to_string(i) + " to have a condition");
  });
  Eigen::MatrixXd marks = Eigen::MatrixXd::Zero(std::ssize(mine.own()), 2);  // and values
  for (std::size_t k = 0; k < own.points.size(); ++k) {
    marks(place[own.points[k]], 0) = 1;
    if (prescribed) marks(place[own.points[k]], 1) = own.values[k];
  }
  const Eigen::MatrixXd all = mine.spread(marks);
  FixedValues result{own.points};
  for (int i = 0; i < mine.cloud().size(); ++i)
    if (place[i] < 0 && all(i, 0) != 0) result.points.push_back(i);
  if (prescribed) result.values = all(result.points, 1);
  return result;
}

/// Where this process's rows are in the system of all.
struct Numbering {
  std::vector<PetscInt> columns;  // number of each of the system's columns
  std::vector<int> diagonal;      // of each row, among the columns
  std::int64_t size;              // of the whole system
};

Numbering numbering(const Subdomain& mine, const DiffusionSystem& system) {
  const MPI_Comm comm = mine.partition().comm();
  const std::vector<int> place = own_places(mine);
  const auto count = static_cast<std::int64_t>(system.rows().size());
  std::int64_t next = 0;
  MPI_Exscan(&count, &next, 1, MPI_INT64_T, MPI_SUM, comm);
  if (rank_of(comm) == 0) next = 0;
  std::vector<PetscInt> numbers(mine.own().size(), -1);
  for (const int i : system.rows()) numbers[place[i]] = static_cast<PetscInt>(next++);
  const std::vector<PetscInt> all = mine.spread(numbers);
  Numbering result{{}, std::vector<int>(system.rows().size()), sum_of(comm, count)};
  std::vector<int> column(mine.cloud().size(), -1);
  for (const int i : system.columns()) {
    column[i] = static_cast<int>(result.columns.size());
    result.columns.push_back(all[i]);
  }
  for (std::size_t k = 0; k < system.rows().size(); ++k)
    result.diagonal[k] = column[system.rows()[k]];
  return result;
}

/// What belongs to rows, for all columns of the system.
Eigen::VectorXd column_values(const Subdomain& mine, const DiffusionSystem& system,
                              const Eigen::VectorXd& of_rows) {
  const std::vector<int> place = own_places(mine);
  Eigen::VectorXd own = Eigen::VectorXd::Zero(std::ssize(mine.own()));
  for (Eigen::Index k = 0; k < of_rows.size(); ++k) own[place[system.rows()[k]]] = of_rows[k];
  return mine.spread(own)(system.columns(), 0);
}

struct RowSum {
  double sum = 0, size = 0;
};

std::vector<RowSum> row_sums(const SparseMatrix& A) {
  std::vector<RowSum> result(A.rows());
  for (int k = 0; k < A.rows(); ++k)
    for (SparseMatrix::InnerIterator a(A, k); a; ++a) {
      result[k].sum += a.value();
      result[k].size += std::abs(a.value());
    }
  return result;
}

/// Throws if a row is not finite, or has only zeros.
void check_rows(const Cloud& cloud, const DiffusionSystem& system,
                const std::vector<RowSum>& sums) {
  for (std::size_t k = 0; k < sums.size(); ++k) {
    const std::string point = "point " + std::to_string(cloud.number(system.rows()[k]));
    if (!std::isfinite(sums[k].size))
      throw InvalidInput("the matrix is not finite in the row of " + point);
    if (sums[k].size == 0) throw InvalidInput("the matrix has only zeros in the row of " + point);
  }
}

/// Throws if constants on a connected set of unknowns are in the null space. Sets that reach over several
/// processes are known by their lowest point, which spreads from process to process.
void check_floating(const Subdomain& mine, const DiffusionSystem& system,
                    const std::vector<RowSum>& sums) {
  const MPI_Comm comm = mine.partition().comm();
  const auto floats = [](const RowSum& row) { return vanishes(row.sum, row.size); };
  if (!anywhere(comm, std::ranges::any_of(sums, floats))) return;
  const std::vector<int> place = own_places(mine);
  const auto& rows = system.rows();
  const auto& columns = system.columns();
  Sets connected(mine.cloud().size());
  for (std::size_t k = 0; k < rows.size(); ++k)
    for (SparseMatrix::InnerIterator a(system.matrix, static_cast<int>(k)); a; ++a)
      if (a.value() != 0) connected.merge(rows[k], columns[a.col()]);
  std::vector<PetscInt> lowest(mine.cloud().size()), sinks(mine.cloud().size());
  for (int i = 0; i < mine.cloud().size(); ++i)
    lowest[i] = static_cast<PetscInt>(mine.cloud().number(connected.of(i)));
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (!floats(sums[k])) sinks[connected.of(rows[k])] = true;
  // Each round, sets hear from the halo what the others' parts of them are called.
  std::vector<PetscInt> own_lowest(mine.own().size()), own_sinks(mine.own().size());
  for (bool changed = true; changed;) {
    for (std::size_t k = 0; k < mine.own().size(); ++k) {
      own_lowest[k] = lowest[connected.of(mine.own()[k])];
      own_sinks[k] = sinks[connected.of(mine.own()[k])];
    }
    const auto heard_lowest = mine.spread(own_lowest), heard_sinks = mine.spread(own_sinks);
    changed = false;
    for (const int i : columns) {
      const int set = connected.of(i);
      if (heard_lowest[i] >= lowest[set] && heard_sinks[i] <= sinks[set]) continue;
      lowest[set] = std::min(lowest[set], heard_lowest[i]);
      sinks[set] = std::max(sinks[set], heard_sinks[i]);
      changed = true;
    }
    changed = anywhere(comm, changed);
  }
  std::int64_t first = mine.partition().size();
  for (const int i : rows)
    if (!sinks[connected.of(i)]) first = std::min<std::int64_t>(first, lowest[connected.of(i)]);
  first = least_of(comm, first);
  if (first == mine.partition().size()) return;
  const std::int64_t count = sum_of(comm, std::int64_t{std::ranges::count_if(rows, [&](int i) {
                                      return lowest[connected.of(i)] == first;
                                    })});
  together(comm, [&] {
    throw SolverError("the matrix is singular: the " + std::to_string(count) +
                      " rows connected with that of point " + std::to_string(first) +
                      " sum to zero (to rounding), so any constant may be added to their solution; "
                      "a fixed value, "
                      "an exchange with the outside or a shorter time step makes it unique");
  });
}

/// The points of the system's columns, with their volumes.
Cloud column_points(const Cloud& cloud, const Eigen::VectorXd& volumes,
                    const std::vector<int>& columns) {
  return Cloud(cloud.positions()(columns, Eigen::all),
               {.volumes = volumes(columns), .box = cloud.box()});
}

/// dt nu / dx^2 at the median row; infinity counts where a row sums to zero.
double stiffness(MPI_Comm comm, const SparseMatrix& A, const Cloud& points,
                 const std::vector<int>& diagonal, const std::vector<RowSum>& sums, int threads) {
  Eigen::VectorXd ratios = row_diffusivities(A, points, diagonal, threads);
  for (Eigen::Index k = 0; k < ratios.size(); ++k)
    ratios[k] = sums[k].sum > 0 && !vanishes(sums[k].sum, sums[k].size)
                    ? ratios[k] / (sums[k].sum * std::pow(points.volumes()[diagonal[k]],
                                                          2.0 / points.dimension()))
                    : std::numeric_limits<double>::infinity();
  return median(comm, ratios);
}

/// Whether every diagonal entry is at least the sum of the magnitudes of the others in its row.
bool is_dominant(const SparseMatrix& A, const std::vector<int>& diagonal,
                 const std::vector<RowSum>& sums) {
  for (int k = 0; k < A.rows(); ++k) {
    const double d = A.coeff(k, diagonal[k]);
    if (!(2 * d >= (1 - 1e-12) * sums[k].size)) return false;
  }
  return true;
}

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

/// A number from -1 to 1 for each row, the same whatever the number of processes.
double noise(std::uint64_t number, std::uint64_t seed) {
  std::uint64_t x = number * 0x9E3779B97F4A7C15u + seed;  // Steele, Lea, Flood: splitmix64
  x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
  x = (x ^ x >> 27) * 0x94D049BB133111EBu;
  return std::ldexp(static_cast<double>((x ^ x >> 31) >> 11), -52) - 1;
}

/// Whether x . A y = y . A x for two arbitrary vectors: comparing entries would take rows of others.
bool is_symmetric(Mat A) {
  const auto x = vector_like(A), y = vector_like(A), Ax = vector_like(A), Ay = vector_like(A);
  PetscInt first;
  check(VecGetOwnershipRange(x.get(), &first, nullptr));
  for_each_entry(x.get(), [&](PetscInt k, double& v) { v = noise(first + k, 1); });
  for_each_entry(y.get(), [&](PetscInt k, double& v) { v = noise(first + k, 2); });
  check(MatMult(A, x.get(), Ax.get()));
  check(MatMult(A, y.get(), Ay.get()));
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

bool has_option(const char* name) {
  PetscBool there;
  check(PetscOptionsHasName(nullptr, nullptr, name, &there));
  return there == PETSC_TRUE;
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

struct Release {
  void operator()(PC object) const { PCDestroy(&object); }
  void operator()(IS object) const { ISDestroy(&object); }
};
template <class Object>
using Owned = std::unique_ptr<std::remove_pointer_t<Object>, Release>;

Handle<Mat> part_of(Mat A, IS rows, IS columns) {
  Mat part;
  check(MatCreateSubMatrix(A, rows, columns, MAT_INITIAL_MATRIX, &part));
  return Handle<Mat>(part);
}

/// MUMPS's factors as a preconditioner. `memory`: bytes for all processes, 0: as many as it takes.
void set_mumps(MPI_Comm comm, PC pc, bool cholesky, double memory) {
  Mat factor;
  check(PCSetType(pc, cholesky ? PCCHOLESKY : PCLU));
  check(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  check(PCFactorSetUpMatSolverType(pc));
  check(PCFactorGetMatrix(pc, &factor));
  check(MatMumpsSetIcntl(factor, 14,
                         100));  // per cent more workspace than estimated: 20 can be too few
  if (memory == 0) return;
  const double megabytes = memory / processes(comm) / 1e6;
  check(MatMumpsSetIcntl(factor, 23, std::max(1, static_cast<int>(std::min(megabytes, 1e9)))));
}

/// Neither a diagonal nor a twin knows anything of boundary conditions, and a preconditioner that gets them
/// wrong costs hundreds of iterations: their rows are factorised among themselves and correct what another
/// preconditioner has done.
class WallCorrection {
 public:
  /// @param walls  among this process's rows
  WallCorrection(MPI_Comm comm, Mat A, const std::vector<int>& walls) {
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
    PCFailedReason failure;
    check(PCGetFailedReason(pc, &failure));
    if (anywhere(comm, failure != PC_NOERROR)) ksp_.reset();  // singular: without, then
  }

  /// Makes z meet the boundary conditions, given the residuals r.
  void correct(Vec r, Vec z) const {
    if (!ksp_) return;
    check(MatMult(rows_.get(), z, residual_.get()));
    check(VecScale(residual_.get(), -1));
    check(VecScatterBegin(scatter_.get(), r, residual_.get(), ADD_VALUES, SCATTER_FORWARD));
    check(VecScatterEnd(scatter_.get(), r, residual_.get(), ADD_VALUES, SCATTER_FORWARD));
    check(KSPSolve(ksp_.get(), residual_.get(), correction_.get()));
    check(VecScatterBegin(scatter_.get(), correction_.get(), z, ADD_VALUES, SCATTER_REVERSE));
    check(VecScatterEnd(scatter_.get(), correction_.get(), z, ADD_VALUES, SCATTER_REVERSE));
  }

 private:
  Handle<Mat> rows_, among_;
  Handle<Vec> residual_, correction_;
  Handle<PetscSF> scatter_;
  Handle<KSP> ksp_;
};

/// What a solver is chosen by.
struct Traits {
  bool dominant, multigrid;
  double ratio;  // dt nu / dx^2
  int dimension;
};

/// A x = b, solved by PETSc.
class Solver {
 public:
  /// @param twin   what multigrid is made of, or null: A itself
  /// @param walls  rows with a boundary condition
  Solver(MPI_Comm comm, Handle<Mat> A, Handle<Mat> twin, const Eigen::VectorXd& volumes,
         const std::vector<int>& walls, const Traits& traits, const SolverOptions& options)
      : comm_(comm),
        A_(std::move(A)),
        twin_(std::move(twin)),
        options_(options),
        scale_(Eigen::VectorXd::Ones(volumes.size())) {
    // Scaled in place, and back again if that does not make it symmetric.
    const auto v = vector_like(A_.get());
    for_each_entry(v.get(), [&](PetscInt k, double& x) { x = volumes[k]; });
    check(MatDiagonalScale(A_.get(), v.get(), nullptr));
    symmetric_ = is_symmetric(A_.get());
    if (symmetric_) {
      scale_ = volumes;
      if (twin_) check(MatDiagonalScale(twin_.get(), v.get(), nullptr));
    } else {
      for_each_entry(v.get(), [&](PetscInt k, double& x) { x = 1 / volumes[k]; });
      check(MatDiagonalScale(A_.get(), v.get(), nullptr));
    }
    b_ = vector_like(A_.get());
    x_ = vector_like(A_.get());
    r_ = vector_like(A_.get());
    set_up(walls, traits);
  }

  const SolverReport& report() const { return report_; }

  /// y = A x
  void multiply(const Eigen::VectorXd& x, Eigen::VectorXd& y) {
    for_each_entry(x_.get(), [&](PetscInt k, double& v) { v = x[k]; });
    check(MatMult(A_.get(), x_.get(), r_.get()));
    for_each_entry(r_.get(), [&](PetscInt k, double& v) { y[k] = v / scale_[k]; });
  }

  SolveReport solve(const Eigen::VectorXd& b, Eigen::VectorXd& x) {
    Stopwatch watch;
    SolveReport result;
    // In units in which b is about 1 its square neither overflows nor vanishes.
    const double largest = largest_of(comm_, b.size() > 0 ? b.cwiseAbs().maxCoeff() : 0.0);
    const int unit = largest > 0 ? std::ilogb(largest) : 0;
    const auto start = [&] {
      for_each_entry(b_.get(),
                     [&](PetscInt k, double& v) { v = scale_[k] * std::ldexp(b[k], -unit); });
      for_each_entry(x_.get(),
                     [&](PetscInt k, double& v) { v = largest > 0 ? std::ldexp(x[k], -unit) : 0; });
      bool finite = true;
      for_each_entry(x_.get(), [&](PetscInt, double& v) { finite &= std::isfinite(v); });
      if (anywhere(comm_, !finite)) check(VecSet(x_.get(), 0));  // a start that far off is none
    };
    start();
    if (!iterate(result,
                 fallback_ ? std::min(options_.max_iterations, 1'000) : options_.max_iterations)) {
      if (!fallback_) throw_unsolved(result);
      const std::string reason = report_.reason + ", and iterations did not converge";
      result = {};
      factorise(Method::Lu, reason);
      start();
      if (!iterate(result, 3)) throw_unsolved(result);
    }
    for_each_entry(x_.get(), [&](PetscInt k, double& v) { x[k] = std::ldexp(v, unit); });
    result.seconds = watch.lap();
    return result;
  }

 private:
  void set_up(const std::vector<int>& walls, const Traits& traits) {
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
        if (!symmetric_)
          together(comm_, [] {
            throw InvalidInput(
                "cholesky needs a matrix that is symmetric after scaling its rows by volume; this "
                "one is not: use lu or krylov");
          });
        return factorise(Method::Cholesky, "as asked");
      case Method::Lu: return factorise(Method::Lu, "as asked");
      case Method::Krylov: reason = chosen ? reason : "as asked"; break;
      case Method::Auto: fallback_ = !chosen; break;
    }
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
  PC corrected_at_walls(PC outer, const std::vector<int>& walls) {
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

  void factorise(Method method, const std::string& reason) {
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
    if (negative_pivots > 0) throw_indefinite();
  }

  [[noreturn]] void throw_indefinite() const {
    together(comm_, [] {
      throw SolverError("the matrix is symmetric but not positive definite: use lu");
    });
    std::abort();  // not reached
  }

  PC new_solver(KSPType type) {
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
  void finish(Method method, const std::string& reason) {
    Stopwatch watch;
    const KSP ksp = ksp_.get();
    check(KSPSetTolerances(ksp, options_.tolerance, PETSC_DEFAULT, 1e30, options_.max_iterations));
    check(KSPSetFromOptions(ksp));
    KSPType type;
    PCType pc_type;
    PC pc;
    check(KSPGetType(ksp, &type));
    check(KSPGetPC(ksp, &pc));
    check(PCGetType(inner_ ? inner_.get() : pc, &pc_type));
    const std::string solver = type, preconditioner = pc_type;
    if (solver != KSPPREONLY) check(KSPSetInitialGuessNonzero(ksp, PETSC_TRUE));
    if (solver == KSPCG && !has_option("-ksp_norm_type"))
      check(KSPSetNormType(ksp, KSP_NORM_UNPRECONDITIONED));
    if (solver == KSPBCGS && !has_option("-ksp_pc_side")) check(KSPSetPCSide(ksp, PC_RIGHT));
    check(KSPSetUp(ksp));
    PCFailedReason failure;
    check(PCGetFailedReason(pc, &failure));
    const bool failed = anywhere(comm_, failure != PC_NOERROR);
    if (failed && method == Method::Cholesky && failure != PC_FACTOR_OUTMEMORY) throw_indefinite();
    if (failed)
      together(comm_, [&] {
        throw SolverError(std::string(name(method)) + ": the matrix could not be factorised" +
                          (failure == PC_FACTOR_OUTMEMORY ? ", memory ran out; krylov takes little"
                                                          : ", it is singular"));
      });
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
    report_.factor.factor_seconds = watch.lap();
  }

  struct Sizes {
    double residual, b;
  };
  /// 2-norms of b - A x, which is left in r_, and of b.
  Sizes sizes() {
    check(MatMult(A_.get(), x_.get(), r_.get()));
    check(VecAYPX(r_.get(), -1, b_.get()));
    double r = 0, b = 0;
    for_each_entry(r_.get(), [&](PetscInt k, double& v) { r += v / scale_[k] * (v / scale_[k]); });
    for_each_entry(b_.get(), [&](PetscInt k, double& v) { b += v / scale_[k] * (v / scale_[k]); });
    return {std::sqrt(sum_of(comm_, r)), std::sqrt(sum_of(comm_, b))};
  }

  /// 2-norm of |b| + |A| |x|: what rounding is relative to.
  double size_of_terms() {
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
  bool iterate(SolveReport& result, int limit) {
    const bool direct = report_.method != Method::Krylov;
    double before = std::numeric_limits<double>::infinity(), tolerance = options_.tolerance;
    const auto solution = vector_like(A_.get());
    for (int left = limit;;) {
      const auto [norm, size] = sizes();
      result.residual = size > 0 ? norm / size : norm;
      if (!std::isfinite(norm)) return false;
      if (norm <= options_.tolerance * size) return true;
      if (norm <= 1e-4 * size &&
          norm <= 8 * std::numeric_limits<double>::epsilon() * size_of_terms())
        return true;
      const bool progress = std::isinf(before) || norm < before / 2;
      if (left <= 0 || !progress) return false;
      if (std::isfinite(before)) tolerance *= std::min(0.5, options_.tolerance * size / norm);
      const bool first = std::isinf(before);
      before = norm;
      const KSP ksp = ksp_.get();
      if (direct) {  // x + A^-1 r
        check(KSPSolve(ksp, r_.get(), solution.get()));
        check(VecAXPY(x_.get(), 1, solution.get()));
        if (!first) ++result.iterations;
        --left;
        continue;
      }
      check(KSPSetTolerances(ksp, tolerance, PETSC_DEFAULT, PETSC_DEFAULT, left));
      check(KSPSolve(ksp, b_.get(), x_.get()));
      PetscInt done;
      check(KSPGetIterationNumber(ksp, &done));
      result.iterations += static_cast<int>(done);
      left -= std::max(1, static_cast<int>(done));
    }
  }

  [[noreturn]] void throw_unsolved(const SolveReport& result) const {
    const bool krylov = report_.method == Method::Krylov;
    together(comm_, [&] {
      if (!std::isfinite(result.residual))
        throw SolverError("the solution by " + report_.description + " is not finite");
      throw SolverError(
          report_.description + " did not converge: relative residual " + rounded(result.residual) +
              " after " + std::to_string(result.iterations) +
              (krylov ? " iterations; try lu" : " refinements; the matrix is nearly singular"),
          result.residual);
    });
    std::abort();  // not reached
  }

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

}  // namespace

struct ImplicitDiffusion::State {
  State(const Subdomain& mine, Operator&& laplacian, const BoundaryConditions& conditions,
        const DiffusionOptions& options);

  const Subdomain& mine;
  std::optional<DiffusionSystem> system;
  std::optional<Solver> solver;
  SolverReport nothing;  // to solve
  Eigen::VectorXd product, rhs, solution;
};

ImplicitDiffusion::State::State(const Subdomain& mine, Operator&& laplacian,
                                const BoundaryConditions& conditions,
                                const DiffusionOptions& options)
    : mine(mine) {
  const MPI_Comm comm = mine.partition().comm();
  together(comm, [&] {
    if (laplacian.points != mine.own())
      throw InvalidInput("the Laplacian does not have the rows of all own points, in order");
    if (laplacian.volumes.size() != mine.cloud().size())
      throw InvalidInput("the Laplacian has " + std::to_string(laplacian.volumes.size()) +
                         " volumes for " + std::to_string(mine.cloud().size()) + " points");
    if (options.source.size() != 0 && options.source.size() != std::ssize(mine.own()))
      throw InvalidInput("the source has " + std::to_string(options.source.size()) +
                         " entries for " + std::to_string(mine.own().size()) + " points");
  });
  BoundaryConditions all = conditions;
  all.fixed = with_halo(mine, conditions.fixed);
  DiffusionOptions equation = options;
  if (anywhere(comm, options.source.size() > 0)) equation.source = mine.spread(options.source);
  together(comm, [&] { system.emplace(mine.cloud(), laplacian, all, equation); });
  const Cloud points = column_points(mine.cloud(), laplacian.volumes, system->columns());
  laplacian = {};

  const auto [columns, diagonal, unknowns] = numbering(mine, *system);
  if (unknowns == 0) {
    nothing = {Method::Krylov, "nothing", "there are no unknowns", 0, {}};
    return;
  }
  const int threads = options.solver.threads;
  const std::vector<int>& walls = system->points.walls;
  const std::vector<RowSum> sums = row_sums(system->matrix);
  together(comm, [&] { check_rows(mine.cloud(), *system, sums); });
  check_floating(mine, *system, sums);
  Traits traits{.dominant = !anywhere(comm, !is_dominant(system->matrix, diagonal, sums)),
                .multigrid = false,
                .ratio = stiffness(comm, system->matrix, points, diagonal, sums, threads),
                .dimension = points.dimension()};
  traits.multigrid = needs_multigrid(traits.ratio, static_cast<double>(unknowns), traits.dimension);
  const Method method = options.solver.method;
  Handle<Mat> twin;
  const bool iterates = method == Method::Auto || method == Method::Krylov;
  // The twin is worth its making where A has long rows or rows that multigrid cannot use.
  const bool wanted = traits.dimension == 3 || anywhere(comm, !walls.empty());
  if (traits.multigrid && iterates && wanted && !has_option("-pc_type")) {
    const Eigen::VectorXd scales =
        column_values(mine, *system, twin_scales(system->matrix, points, diagonal, walls, threads));
    SparseMatrix rows;
    together(comm, [&] { compact_twin(system->matrix, points, diagonal, scales, threads, rows); });
    twin = make_matrix(comm, rows, columns);
  }
  Handle<Mat> A = make_matrix(comm, system->matrix, columns);
  system->matrix = SparseMatrix();
  solver.emplace(comm, std::move(A), std::move(twin), system->points.cloud.volumes(), walls, traits,
                 options.solver);
  for (Eigen::VectorXd* v : {&product, &rhs, &solution}) v->resize(std::ssize(sums));
}

ImplicitDiffusion::ImplicitDiffusion(const Subdomain& mine, Operator laplacian,
                                     const BoundaryConditions& conditions,
                                     const DiffusionOptions& options)
    : state_(std::make_unique<State>(mine, std::move(laplacian), conditions, options)) {}
ImplicitDiffusion::ImplicitDiffusion(ImplicitDiffusion&&) noexcept = default;
ImplicitDiffusion::~ImplicitDiffusion() = default;

SolveReport ImplicitDiffusion::step(Eigen::VectorXd& u) {
  State& s = *state_;
  const Subdomain& mine = s.mine;
  together(mine.partition().comm(), [&] {
    if (u.size() != std::ssize(mine.own()))
      throw InvalidInput("the field has " + std::to_string(u.size()) + " values for " +
                         std::to_string(mine.own().size()) + " points");
    for (Eigen::Index k = 0; k < u.size(); ++k)
      if (!std::isfinite(u[k]))
        throw InvalidInput("the field is not finite at point " +
                           std::to_string(mine.cloud().number(mine.own()[k])));
  });
  Eigen::VectorXd all = mine.spread(u);
  SolveReport report;
  if (s.solver) {
    const std::vector<int>& rows = s.system->rows();
    s.solution = all(rows);
    if (s.system->needs_product()) s.solver->multiply(s.solution, s.product);
    s.system->right_hand_side(all.data(), s.product.data(), s.rhs.data());
    report = s.solver->solve(s.rhs, s.solution);
    all(rows) = s.solution;
  }
  s.system->set_fixed(all.data());
  u = all(mine.own());
  return report;
}

const SolverReport& ImplicitDiffusion::solver() const {
  return state_->solver ? state_->solver->report() : state_->nothing;
}

}  // namespace gradpsi::petsc
