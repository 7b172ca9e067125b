#include "solve/lu.hpp"

#include <umfpack.h>

#include <array>
#include <limits>
#include <new>
#include <vector>

#include "base/parallel.hpp"
#include "base/stopwatch.hpp"
#include "gradpsi/error.hpp"
#include "solve/cholesky.hpp"
#include "solve/factorisation_threads.hpp"

namespace gradpsi {
namespace {

using Int = SuiteSparse_long;

/// Throws what UMFPACK reported, if it is an error.
void check(int status) {
  if (status == UMFPACK_ERROR_out_of_memory) throw std::bad_alloc();
  if (status == UMFPACK_WARNING_singular_matrix)
    throw SolverError("the matrix is singular: UMFPACK met a pivot that is 0");
  if (status != UMFPACK_OK) throw SolverError("UMFPACK failed: status " + std::to_string(status));
}

/// What Cholesky would take of a matrix with the pattern of A + A^T.
FactorReport expected_cholesky(const SparseMatrix& A, const Elimination& elimination) {
  // Assigned: if memory runs out in Eigen's constructors from expressions, some of it is lost.
  SparseMatrix transposed, both;
  transposed = A.transpose();
  both = A + transposed;
  constexpr double unlimited = std::numeric_limits<double>::infinity();
  return Cholesky(both, Eigen::VectorXd::Ones(A.rows()), elimination, unlimited, 1).report();
}

}  // namespace

struct Lu::State {
  ~State() {
    umfpack_dl_free_symbolic(&symbolic);
    umfpack_dl_free_numeric(&numeric);
  }

  int threads = 1;
  // The rows of A are the columns of its transpose, which is what is factorised.
  std::vector<Int> columns, rows;
  void* symbolic = nullptr;
  void* numeric = nullptr;
  std::array<double, UMFPACK_CONTROL> control;
  std::array<double, UMFPACK_INFO> info;
  std::vector<Int> integer_workspace;
  std::vector<double> workspace;
  FactorReport report;
};

Lu::Lu(const SparseMatrix& A, const Elimination& elimination, double memory, int threads)
    : state_(std::make_unique<State>()) {
  State& s = *state_;
  Stopwatch watch;
  // UMFPACK's own estimates are bounds twenty times too high. With pivots on the diagonal L and U are
  // about as full as the Cholesky factor of A + A^T; UMFPACK works in half as much again.
  const FactorReport expected = expected_cholesky(A, elimination);
  if (const double bytes = 1.5 * 2 * 8 * expected.entries; bytes > memory)
    throw FactorTooLarge(bytes, memory);
  // Small blocks, as in two dimensions, are multiplied faster by one thread than by two (1.6x).
  s.threads = expected.flops < 1000 * expected.entries ? 1 : checked_threads(threads);
  s.columns.assign(A.outerIndexPtr(), A.outerIndexPtr() + A.rows() + 1);
  s.rows.assign(A.innerIndexPtr(), A.innerIndexPtr() + A.nonZeros());
  s.integer_workspace.resize(A.rows());
  s.workspace.resize(A.rows());
  umfpack_dl_defaults(s.control.data());
  s.control[UMFPACK_STRATEGY] = UMFPACK_STRATEGY_SYMMETRIC;  // patterns are, but for a few rows
  s.control[UMFPACK_ORDERING] =
      elimination.ordering == Ordering::Metis ? UMFPACK_ORDERING_METIS : UMFPACK_ORDERING_AMD;
  s.control[UMFPACK_IRSTEP] = 0;  // refinement is the caller's, with the matrix as it is
  const Int n = A.rows();
  std::vector<Int> permutation(elimination.permutation.begin(), elimination.permutation.end());
  check(permutation.empty()
            ? umfpack_dl_symbolic(n, n, s.columns.data(), s.rows.data(), A.valuePtr(), &s.symbolic,
                                  s.control.data(), s.info.data())
            : umfpack_dl_qsymbolic(n, n, s.columns.data(), s.rows.data(), A.valuePtr(),
                                   permutation.data(), &s.symbolic, s.control.data(),
                                   s.info.data()));
  s.report.description = "UMFPACK, ordered by " + std::string(name(elimination.ordering));
  s.report.analyse_seconds = elimination.seconds + watch.lap();
}

Lu::Lu(Lu&&) noexcept = default;
Lu& Lu::operator=(Lu&&) noexcept = default;
Lu::~Lu() = default;

void Lu::factorise(const SparseMatrix& A) {
  State& s = *state_;
  Stopwatch watch;
  const FactorisationThreads threads(s.threads);
  umfpack_dl_free_numeric(&s.numeric);
  check(umfpack_dl_numeric(s.columns.data(), s.rows.data(), A.valuePtr(), s.symbolic, &s.numeric,
                           s.control.data(), s.info.data()));
  s.report.entries = s.info[UMFPACK_LNZ] + s.info[UMFPACK_UNZ];
  s.report.flops = s.info[UMFPACK_FLOPS];
  s.report.bytes = s.info[UMFPACK_NUMERIC_SIZE] * s.info[UMFPACK_SIZE_OF_UNIT];
  s.report.factor_seconds = watch.lap();
}

void Lu::solve(const double* b, double* x, int columns) {
  State& s = *state_;
  const FactorisationThreads threads(s.threads);
  const std::size_t n = s.workspace.size();
  for (int c = 0; c < columns; ++c)
    check(umfpack_dl_wsolve(UMFPACK_Aat, nullptr, nullptr, nullptr, x + c * n, b + c * n, s.numeric,
                            s.control.data(), s.info.data(), s.integer_workspace.data(),
                            s.workspace.data()));
}

const FactorReport& Lu::report() const { return state_->report; }

}  // namespace gradpsi
