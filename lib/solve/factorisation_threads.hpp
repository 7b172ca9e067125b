#pragma once

namespace gradpsi {

/// While one of these is alive OpenBLAS, if it is the BLAS at hand, runs `threads` threads, OpenMP
/// regions of the calling thread run one, and its denormal numbers are flushed to zero (they slow a
/// factorisation down several times). All is as before when the last one ends.
///
/// CHOLMOD 5.12 starts four OpenMP threads whatever it is told; times those of the BLAS they
/// would fight for the cores.
class FactorisationThreads {
 public:
  explicit FactorisationThreads(int threads);
  ~FactorisationThreads();
  FactorisationThreads(const FactorisationThreads&) = delete;
  FactorisationThreads& operator=(const FactorisationThreads&) = delete;

 private:
  int active_levels_, threads_;
  unsigned control_;  // of floating point
};

}  // namespace gradpsi
