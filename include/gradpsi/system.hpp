#pragma once

#include <span>
#include <vector>

#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/diffusion.hpp"
#include "gradpsi/operator.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

/// The linear system A x = b of a step of du/dt = nu lap u + f by the theta method with a Laplacian's
/// matrix Psi,
///
///     (I/dt - theta nu Psi) u^{n+1} = (I/dt + (1 - theta) nu Psi) u^n + f
///
/// at points without a condition: for ImplicitDiffusion and for solvers of one's own. Fixed points are
/// eliminated, their columns going to the right-hand side, so that a symmetric matrix stays one. An
/// infinite dt with theta = 1 is the steady problem -nu Psi u = f.
///
/// The Laplacian may have some of the points' rows only, AssemblyOptions::rows: then so has the system,
/// and its columns are the unknowns among all points. So a process assembles its own rows of a larger
/// system, given the points around its own.
class DiffusionSystem {
 public:
  /// @param cloud       n points
  /// @param laplacian   m rows
  /// @param conditions  fixed points: all of the cloud's; walls: those that have a row
  /// @param options     all but how it is solved
  /// @throws InvalidInput  if sizes disagree, a number is out of range or not finite, a point is named
  ///   twice or has two conditions, or one that has none has a row that could not be computed
  DiffusionSystem(const Cloud& cloud, const Operator& laplacian,
                  const BoundaryConditions& conditions, const DiffusionOptions& options);

  /// A: a row for each of rows(), a column for each of columns(); empty once it has been taken.
  const SparseMatrix& matrix() const { return matrix_; }
  /// What a solver may know of the rows beside A; empty once it has been taken.
  const SystemPoints& points() const { return points_; }
  SparseMatrix take_matrix();  ///< A, whose memory is then the caller's
  SystemPoints take_points();  ///< points(), likewise

  /// The points whose rows these are: the Laplacian's but for fixed ones, in their order.
  const std::vector<int>& rows() const { return rows_; }
  /// The points whose value is unknown, ascending; if the Laplacian has all rows, the same as rows().
  const std::vector<int>& columns() const { return columns_; }

  /// Writes b for a field u.
  /// @param u        n values, finite
  /// @param product  A u at the rows, for columns() of u; not looked at if theta is 1
  /// @param b        one number a row
  /// @throws InvalidInput  if sizes disagree
  void right_hand_side(std::span<const double> u, std::span<const double> product,
                       std::span<double> b);
  /// Writes b for a backward Euler step of theta dt instead, whose matrix is A, too.
  /// @throws InvalidInput  if sizes disagree
  void damped_right_hand_side(std::span<const double> u, std::span<double> b);
  /// Whether right_hand_side() needs a product.
  bool needs_product() const { return theta_ < 1; }
  /// Puts prescribed values in their place among u's n.
  void set_fixed(std::span<double> u) const;

  /// Another source, n values; empty: 0.
  /// @throws InvalidInput  if the size is wrong or a value is not finite (names the point)
  void set_source(const VectorView& source);
  /// Other values of the fixed points, in their order; empty: each keeps the value it has.
  /// @throws InvalidInput  as above
  void set_fixed_values(DenseVector values);
  /// Another flux of the walls, in their order; empty: 0.
  /// @throws InvalidInput  as above
  void set_flux(const VectorView& flux);

  /// Changes the entries of a matrix that was taken to those of another time step.
  /// @throws InvalidInput  if the step is out of range, or the matrix is another one
  void set_time_step(double time_step, SparseMatrix& matrix);

 private:
  struct WallRow {
    int row;
    double size;       // its largest entry, with the sign of the diagonal
    double diffusion;  // theta nu |psi_ii|
    double scale;      // what the row is multiplied by
  };
  struct Sources;
  std::vector<int> choose_rows(const Operator& laplacian, const std::vector<int>& fixed_place);
  void add_walls(const Cloud& cloud, const WallConditions& walls, Sources& sources);
  void check_rows(const Cloud& cloud, const Operator& laplacian, const Sources& sources) const;
  void fill(const Sources& sources, const std::vector<int>& fixed_place);
  void add_rate(const Cloud& cloud);
  static double row_scale(const WallRow& wall, double rate);
  double* diagonal(SparseMatrix& matrix, int row) const;
  template <class F>
  void for_each_row(std::span<const double> u, std::span<double> b, const F& f);

  SparseMatrix matrix_;
  SystemPoints points_;
  std::vector<int> rows_, columns_;
  FixedValues fixed_;
  std::vector<WallRow> walls_;
  std::vector<int> diagonal_places_;  // each row's point among the columns
  DenseVector evolves_;    // 1 for rows with the equation, 0 for those with a wall condition
  DenseVector diagonal_;   // of the matrix without 1/dt, where rows evolve
  SparseMatrix coupling_;  // rows x fixed: what known values add to the right-hand side
  DenseVector constant_;   // what source and flux add
  double time_step_, theta_;
  int point_count_, threads_;
  DenseVector known_;  // workspace of right_hand_side()
};

/// A where some values follow from the others, u at `points` being such that conditions u = 0, as at walls
/// without flux: what the other values evolve by.
/// @param A           n x n
/// @param points      k of them, each once
/// @param conditions  k x n
/// @return  n x n: A u for those u, from the other values; rows and columns of `points` are empty
/// @throws InvalidInput  if sizes disagree, a point is out of range or named twice, or a condition holds
///   whatever the values at `points` are
/// @throws SolverError   if conditions leave these values open
SparseMatrix eliminate(const SparseMatrix& A, const std::vector<int>& points,
                       const SparseMatrix& conditions);

}  // namespace gradpsi
#pragma GCC visibility pop
