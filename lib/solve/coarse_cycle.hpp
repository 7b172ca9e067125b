#pragma once

#include <optional>
#include <vector>

#include "multigrid/hierarchy.hpp"
#include "solve/cholesky.hpp"

namespace gradpsi {

/// What cycles over coarser levels need to know beside these.
struct CycleOptions {
  bool floats;    // constants are in the null space of all levels' matrices
  double memory;  // bytes that the coarsest level's factor may take
  int threads;
};

/// The coarser levels of multigrid: about the solution of the first one's equations, by W-cycles with Jacobi's method
/// as the smoother and a factor of the coarsest level. Symmetric and positive definite.
class [[gnu::visibility("default")]] CoarseCycle {
 public:
  CoarseCycle();
  ~CoarseCycle();

  void make(std::vector<CoarseLevel> levels, const CycleOptions& options);
  /// For another medium on the same points; see renew() of hierarchy.hpp.
  void renew(const MediumChange& change, double scale, const CycleOptions& options);
  void clear() { levels_.clear(); }

  bool empty() const { return levels_.empty(); }
  int size() const { return static_cast<int>(levels_.size()); }
  const CoarseLevel& first() const { return levels_.front(); }

  /// Of the first level, to be written before solve(), which may change it.
  DenseVector& right_hand_side() { return levels_.front().b; }
  /// About the solution on the first level.
  const DenseVector& solve();

  double entries() const;  // of all levels' matrices
  double bytes() const;

 private:
  struct Level : CoarseLevel {
    double damping = 1;                  // of the smoother
    DenseVector step = {};               // that over the diagonal
    DenseVector b = {}, x = {}, r = {};  // right-hand side, correction, residual
  };

  void set_steps(Level & level);
  void factorise_bottom();
  void solve_level(std::size_t l, bool start_at_zero);

  std::vector<Level> levels_;
  CycleOptions options_ = {};
  std::optional<Cholesky> bottom_;
};

}  // namespace gradpsi
