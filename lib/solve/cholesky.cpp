#include "solve/cholesky.hpp"

#include <cholmod.h>

#include <algorithm>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "base/parallel.hpp"
#include "base/stopwatch.hpp"
#include "gradpsi/error.hpp"
#include "solve/factorisation_threads.hpp"

namespace gradpsi {
namespace {

using Int = SuiteSparse_long;

/// A factorisation's own settings and workspace: no two of them share any.
class Common {
 public:
  explicit Common(const Elimination& elimination) {
    cholmod_l_start(&common_);
    common_.print = 0;
    common_.final_ll = 1;  // L L^T: a pivot that is not positive is an error, not a sign
    common_.quick_return_if_not_posdef = 1;
    common_.nmethods = 1;  // its own strategy would try METIS as well
    common_.postorder = 1;
    common_.method[0].ordering = elimination.permutation.size() > 0        ? CHOLMOD_GIVEN
                                 : elimination.ordering == Ordering::Metis ? CHOLMOD_METIS
                                                                           : CHOLMOD_AMD;
  }
  ~Common() { cholmod_l_finish(&common_); }
  Common(const Common&) = delete;
  Common& operator=(const Common&) = delete;

  cholmod_common* get() { return &common_; }

  /// Throws what CHOLMOD reported, if anything other than a matrix that is not positive definite.
  void check(const char* what) {
    if (common_.status == CHOLMOD_OUT_OF_MEMORY) throw std::bad_alloc();
    if (common_.status < CHOLMOD_OK)
      throw SolverError(std::string("CHOLMOD could not ") + what + ": status " +
                        std::to_string(common_.status));
  }

 private:
  cholmod_common common_;
};

template <class T, int (*release)(T**, cholmod_common*)>
class Owned {
 public:
  explicit Owned(Common& common) : common_(&common) {}
  ~Owned() { release(&object, common_->get()); }
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;

  T* object = nullptr;

 private:
  Common* common_;
};

using Sparse = Owned<cholmod_sparse, cholmod_l_free_sparse>;
using Factor = Owned<cholmod_factor, cholmod_l_free_factor>;
using Dense = Owned<cholmod_dense, cholmod_l_free_dense>;

}  // namespace

struct Cholesky::State {
  State(Eigen::VectorXd scale, const Elimination& elimination, int threads)
      : scale(std::move(scale)), threads(checked_threads(threads)), common(elimination) {}

  void set_pattern(const SparseMatrix& A);
  void set_values(const SparseMatrix& A);
  double factor_bytes() const;

  Eigen::VectorXd scale;
  int threads;
  Common common;
  Sparse S{common};  // its lower triangle by columns: the upper one of A by rows
  Factor L{common};
  Dense B{common}, X{common}, Y{common}, E{common};
  FactorReport report;
};

void Cholesky::State::set_pattern(const SparseMatrix& A) {
  const auto n = static_cast<std::size_t>(A.rows());
  std::size_t entries = 0;
  for (int i = 0; i < A.rows(); ++i)
    for (SparseMatrix::InnerIterator a(A, i); a; ++a) entries += a.col() >= i;
  S.object = cholmod_l_allocate_sparse(n, n, entries, 1, 1, -1, CHOLMOD_REAL, common.get());
  common.check("hold the matrix");
  Int* const columns = static_cast<Int*>(S.object->p);
  Int* row = static_cast<Int*>(S.object->i);
  for (int i = 0; i < A.rows(); ++i) {
    columns[i] = row - static_cast<Int*>(S.object->i);
    for (SparseMatrix::InnerIterator a(A, i); a; ++a)
      if (a.col() >= i) *row++ = a.col();
  }
  columns[n] = static_cast<Int>(entries);
}

void Cholesky::State::set_values(const SparseMatrix& A) {
  double* value = static_cast<double*>(S.object->x);
  for (int i = 0; i < A.rows(); ++i)
    for (SparseMatrix::InnerIterator a(A, i); a; ++a)
      if (a.col() >= i) *value++ = scale[i] * a.value();
}

double Cholesky::State::factor_bytes() const {
  const cholmod_factor& f = *L.object;
  if (f.is_super)  // blocks, their rows, and the largest block's update
    return 8.0 * (static_cast<double>(f.xsize) + static_cast<double>(f.ssize) +
                  static_cast<double>(f.maxcsize));
  return 16.0 * report.entries;
}

Cholesky::Cholesky(const SparseMatrix& A, Eigen::VectorXd scale, const Elimination& elimination,
                   double memory, int threads)
    : state_(std::make_unique<State>(std::move(scale), elimination, threads)) {
  State& s = *state_;
  Stopwatch watch;
  s.set_pattern(A);
  std::vector<Int> permutation(elimination.permutation.begin(), elimination.permutation.end());
  s.L.object = cholmod_l_analyze_p(s.S.object, permutation.empty() ? nullptr : permutation.data(),
                                   nullptr, 0, s.common.get());
  s.common.check("analyse the matrix");
  s.report = {.description = std::string("CHOLMOD, ") +
                             (s.L.object->is_super ? "supernodal" : "simplicial") +
                             ", ordered by " + std::string(name(elimination.ordering)),
              .entries = s.common.get()->lnz,
              .flops = s.common.get()->fl,
              .analyse_seconds = elimination.seconds + watch.lap()};
  s.report.bytes = s.factor_bytes();
  if (s.report.bytes > memory) throw FactorTooLarge(s.report.bytes, memory);
}

Cholesky::Cholesky(Cholesky&&) noexcept = default;
Cholesky& Cholesky::operator=(Cholesky&&) noexcept = default;
Cholesky::~Cholesky() = default;

bool Cholesky::factorise(const SparseMatrix& A) {
  State& s = *state_;
  Stopwatch watch;
  s.set_values(A);
  const FactorisationThreads threads(s.threads);
  cholmod_l_factorize(s.S.object, s.L.object, s.common.get());
  s.common.check("factorise the matrix");
  s.report.factor_seconds = watch.lap();
  return s.L.object->minor == s.L.object->n;
}

void Cholesky::solve(const double* b, double* x, int columns) {
  State& s = *state_;
  const auto n = static_cast<std::size_t>(s.scale.size());
  if (!s.Y.object || s.B.object->ncol != static_cast<std::size_t>(columns)) {
    // CHOLMOD's solve takes no notice when there is no memory for its result and its workspace: it is
    // given them in the shape that it wants.
    for (cholmod_dense** dense : {&s.Y.object, &s.X.object, &s.B.object})
      cholmod_l_free_dense(dense, s.common.get());
    const auto allocate = [&](cholmod_dense** dense, std::size_t height, std::size_t width) {
      *dense = cholmod_l_allocate_dense(height, width, height, CHOLMOD_REAL, s.common.get());
      s.common.check("hold the right-hand sides");
    };
    allocate(&s.B.object, n, columns);
    allocate(&s.X.object, n, columns);
    if (s.L.object->is_super)
      allocate(&s.Y.object, n, columns);
    else
      allocate(&s.Y.object, 4, n);
  }
  // CHOLMOD shrinks this workspace to the columns that it solves for, and next time wants four again.
  if (!s.L.object->is_super) s.Y.object->nrow = s.Y.object->d = 4;
  double* const scaled = static_cast<double*>(s.B.object->x);
  for (int c = 0; c < columns; ++c)
    for (std::size_t i = 0; i < n; ++i) scaled[c * n + i] = s.scale[i] * b[c * n + i];
  const FactorisationThreads threads(s.threads);
  cholmod_l_solve2(CHOLMOD_A, s.L.object, s.B.object, nullptr, &s.X.object, nullptr, &s.Y.object,
                   &s.E.object, s.common.get());
  s.common.check("solve with the factor");
  std::copy_n(static_cast<const double*>(s.X.object->x), columns * n, x);
}

const FactorReport& Cholesky::report() const { return state_->report; }

}  // namespace gradpsi
