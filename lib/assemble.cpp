#include "gradpsi/assemble.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>

#include "check.hpp"
#include "dispatch.hpp"
#include "gradpsi/error.hpp"
#include "moments.hpp"
#include "parallel.hpp"
#include "points.hpp"
#include "text.hpp"

namespace gradpsi {
namespace {

/// h^(d+2) phi(r) / s_d at q = r/h, phi of Tables I and II; for diffuse-ns h^(d+1) phi(r) / s_d.
double scaled_phi(const Scheme& scheme, int d, const Profile& p, double q) {
  const bool gradient = scheme.derivative == Derivative::Gradient;
  switch (scheme.weight) {
    case Weight::Direct: return gradient ? -p.dw_over_q : p.d2w + (d - 1) * p.dw_over_q;
    case Weight::Diffuse: return (gradient ? d : 2 * d) * p.w / (q * q);
    case Weight::DiffuseNs: return (gradient ? 1 : 2) * p.w / q;
    case Weight::Mixed: return -2 * p.dw_over_q;
  }
  return 0;
}

/// One row of an operator. Its memory is used again for the next row.
template <int D, Derivative Which>
class Row {
 public:
  static constexpr int K = Which == Derivative::Gradient ? D : 1;  // numbers per neighbour

  Row(const Scheme& scheme, const Kernel& kernel) : scheme_(scheme), kernel_(kernel) {}

  /// Takes up the neighbours of point i with their weights omega_j phi(r).
  void gather(const Cloud& cloud, const Neighbours& near, const Eigen::VectorXd& volumes, int i) {
    const auto neighbours = near.of(i);
    n_ = near.count(i);
    h_ = near.support(i);
    const double per_h = 1 / h_;
    Columns s = this->s(), q = this->q(), weight = this->weight();
    for (int k = 0; k < n_; ++k) s.row(k) = displacement<D>(cloud, i, neighbours[k]) * per_h;
    q = s.square().rowwise().sum().sqrt().min(1);  // rounding can lift a neighbour past the support
    for (int k = 0; k < n_; ++k)
      weight(k) = volumes[neighbours[k]] * scaled_phi(scheme_, D, kernel_.profile(q(k)), q(k));
    // One h at a time: 1 / h^d may be beyond a double where omega / h^d is not.
    for (int a = 0; a < D; ++a) weight *= per_h;
    weight *= kernel_.normalisation[D - 1];
  }

  /// Computes the weights a_ij at the given consistency; returns the moment system's reciprocal
  /// condition number, 0 if it is singular, 1 if there is none.
  double solve(Consistency consistency) {
    if (n_ == 0) return 0;
    if constexpr (Which == Derivative::Gradient)
      return solve_gradient(consistency);
    else
      return solve_laplacian(consistency);
  }

  /// a_ij, n x K, of the last solve(), and their sums, K numbers.
  Columns weights() { return weights_.columns(n_, K); }
  const Eigen::Array<double, K, 1>& sums() const { return sums_; }
  void set_zero() {
    weights().setZero();
    sums_.setZero();
  }

 private:
  template <int Rows, int Cols>
  using Matrix = Eigen::Matrix<double, Rows, Cols>;

  Columns s() { return s_.columns(n_, D); }            // r_ij / h
  Columns q() { return q_.columns(n_, 1); }            // |r_ij| / h
  Columns weight() { return weight_.columns(n_, 1); }  // omega_j phi(r), but for zoc_factor()

  /// scaled_phi lacks h^2 (diffuse-ns: h); the gradient's r_ij = h s gives one h back.
  double zoc_factor() const {
    return (scheme_.weight == Weight::DiffuseNs ? h_ : 1) /
           (Which == Derivative::Gradient ? h_ : h_ * h_);
  }

  double solve_gradient(Consistency consistency) {
    switch (consistency) {
      case Consistency::Zoc: return emit<Linear<D>>(zoc_factor() * Matrix<D, K>::Identity());
      case Consistency::Foc: return correct<Linear<D>, Linear<D>>(Matrix<D, K>::Identity() / h_);
      case Consistency::Soc:
        return correct<Quadratic<D>, Quadratic<D>>(Matrix<quadratic_size<D>, K>::Identity() / h_);
    }
    return 0;
  }

  double solve_laplacian(Consistency consistency) {
    if (consistency == Consistency::Zoc) return emit<Constant<D>>(Matrix<1, 1>(zoc_factor()));
    Matrix<quadratic_size<D>, 1> rhs = Matrix<quadratic_size<D>, 1>::Zero();
    for (int a = 0; a < D; ++a) rhs[diagonal_row<D>(a)] = 2 / (h_ * h_);
    return correct<Quadratic<D>, Directions<D>>(rhs);
  }

  /// Solves (sum w p t^T) C = rhs and sets the weights w_j C^T t_j.
  template <class Test, class Trial>
  double correct(const Matrix<Trial::size, K>& rhs) {
    constexpr int m = Trial::size;
    constexpr bool definite = std::is_same_v<Test, Trial>;  // and all w_j > 0
    if (n_ < m) return 0;
    const Columns t = trial_.columns(n_, m);
    Trial::fill(s(), q(), t);
    const Columns p = definite ? t : test_.columns(n_, m);
    if (!definite) Test::fill(s(), q(), p);
    const auto inverse =
        invert<definite>(moments<definite, m>(weight(), p, t, weighted_.columns(n_, m)));
    combine<m>(t, inverse.matrix * rhs);
    return inverse.reciprocal_condition;
  }

  template <class Trial>
  double emit(const Matrix<Trial::size, K>& C) {
    const Columns t = trial_.columns(n_, Trial::size);
    Trial::fill(s(), q(), t);
    combine<Trial::size>(t, C);
    return 1;
  }

  template <int M>
  void combine(const Columns& t, const Matrix<M, K>& C) {
    Columns a = weights();
    for (int c = 0; c < K; ++c) {
      a.col(c) = C(0, c) * t.col(0);
      for (int l = 1; l < M; ++l) a.col(c) += C(l, c) * t.col(l);
      a.col(c) *= weight().col(0);
      sums_[c] = a.col(c).sum();
    }
  }

  Scheme scheme_;
  Kernel kernel_;
  int n_ = 0;     // neighbours
  double h_ = 0;  // support
  Buffer s_, q_, weight_, trial_, test_, weighted_, weights_;
  Eigen::Array<double, K, 1> sums_;
};

struct Solved {
  double reciprocal_condition;  // of the system asked for
  RowOutcome outcome;           // Zero: degenerate, whatever was tried
};

/// The consistencies to try for a row, best first, with what having used them is called.
struct Step {
  Consistency consistency;
  RowOutcome outcome;
};
std::vector<Step> ladder(const Scheme& scheme, OnDegenerate policy) {
  std::vector<Step> steps = {{scheme.consistency, RowOutcome::AsAsked}};
  if (policy != OnDegenerate::Lower) return steps;
  if (scheme.consistency == Consistency::Soc && scheme.derivative == Derivative::Gradient)
    steps.push_back({Consistency::Foc, RowOutcome::LoweredToFoc});
  if (scheme.consistency != Consistency::Zoc)
    steps.push_back({Consistency::Zoc, RowOutcome::LoweredToZoc});
  return steps;
}

template <class Row>
Solved solve_row(Row& row, const std::vector<Step>& steps) {
  double asked = 0;
  for (const Step& step : steps) {
    const double reciprocal_condition = row.solve(step.consistency);
    if (&step == &steps.front()) asked = reciprocal_condition;
    if (reciprocal_condition >= singular_below && row.sums().isFinite().all())
      return {asked, step.outcome};
  }
  row.set_zero();
  return {asked, RowOutcome::Zero};
}

/// The neighbours of `rows` plus the diagonal, compressed; the values are left as they come.
void set_pattern(SparseMatrix& matrix, const Neighbours& near, const std::vector<int>& rows,
                 int threads) {
  const int m = static_cast<int>(rows.size());
  matrix.resize(m, near.size());
  int* const outer = matrix.outerIndexPtr();
  for (int k = 0; k < m; ++k) outer[k + 1] = outer[k] + near.count(rows[k]) + 1;
  matrix.resizeNonZeros(outer[m]);
  parallel_chunks(m, 1024, threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const auto neighbours = near.of(rows[k]);
      const auto after = std::ranges::lower_bound(neighbours, rows[k]);
      int* column = std::copy(neighbours.begin(), after, matrix.innerIndexPtr() + outer[k]);
      *column++ = rows[k];
      std::copy(after, neighbours.end(), column);
    }
  });
}

template <int D, Derivative Which>
Operator assemble(const Scheme& scheme, const Cloud& cloud, const Neighbours& near,
                  const Eigen::VectorXd& volumes, const std::vector<int>& rows,
                  const AssemblyOptions& options) {
  constexpr int K = Row<D, Which>::K;
  const int m = static_cast<int>(rows.size());
  Operator result;
  result.axes.resize(K);
  for (SparseMatrix& matrix : result.axes) set_pattern(matrix, near, rows, options.threads);
  const int* const offsets = result.axes[0].outerIndexPtr();
  RowReport& report = result.rows;
  report = {Eigen::VectorXi(m), Eigen::VectorXd(m), std::vector<RowOutcome>(m)};

  const auto steps = ladder(scheme, options.on_degenerate);
  parallel_chunks(
      m, 512, options.threads,
      [&, row = Row<D, Which>(scheme, options.kernel)](int begin, int end) mutable {
        for (int k = begin; k < end; ++k) {
          const int i = rows[k];
          const auto neighbours = near.of(i);
          row.gather(cloud, near, volumes, i);
          const Solved solved = solve_row(row, steps);
          report.neighbours[k] = near.count(i);
          report.reciprocal_condition[k] = solved.reciprocal_condition;
          report.outcome[k] = solved.outcome;

          const int before =
              static_cast<int>(std::ranges::lower_bound(neighbours, i) - neighbours.begin());
          const Columns weights = row.weights();
          for (int axis = 0; axis < K; ++axis) {
            const double* const a = weights.col(axis).data();
            double* const entry = std::copy_n(a, before, result.axes[axis].valuePtr() + offsets[k]);
            *entry = 0 - row.sums()[axis];  // 0, not -0, in a row left zero
            std::copy(a + before, a + near.count(i), entry + 1);
          }
        }
      });
  return result;
}

void check(const Scheme& scheme, const Cloud& cloud, const Neighbours& near,
           const AssemblyOptions& options) {
  static_cast<void>(Scheme(name(scheme)));  // throws unless it is one of schemes()
  checked_threads(options.threads);
  check_match(cloud, near);
  check_kernel(options.kernel, cloud.dimension());
  if (!options.rows) return;
  std::int64_t entries = 0;
  for (const int i : *options.rows) {
    if (i < 0 || i >= cloud.size())
      throw InvalidInput("row " + std::to_string(i) + " is not one of " +
                         std::to_string(cloud.size()) + " points");
    entries += near.count(i) + 1;
  }
  if (entries > std::numeric_limits<int>::max())
    throw InvalidInput("the rows would have " + std::to_string(entries) +
                       " entries, more than 2^31 - 1");
}

/// The unknowns of a row's moment system; 0 if there is none.
int unknowns(const Scheme& scheme, int dimension) {
  switch (scheme.consistency) {
    case Consistency::Zoc: return 0;
    case Consistency::Foc: return dimension;
    case Consistency::Soc: return dimension * (dimension + 3) / 2;
  }
  return 0;
}

void throw_if_degenerate(const Scheme& scheme, int dimension, const std::vector<int>& rows,
                         const RowReport& report) {
  const int count = report.degenerate();
  if (count == 0) return;
  const auto first =
      std::ranges::find_if(report.outcome, [](auto o) { return o != RowOutcome::AsAsked; }) -
      report.outcome.begin();
  const int neighbours = report.neighbours[first];
  const double rcond = report.reciprocal_condition[first];
  const int needed = unknowns(scheme, dimension);
  const std::string why = neighbours == 0 ? "it has no neighbour"
                          : neighbours < needed
                              ? "at least " + std::to_string(needed) + " neighbours are needed"
                          : rcond >= singular_below ? "its weights are not finite"
                                                    : "its moment system is singular";
  throw StencilError(name(scheme) + " cannot be computed at point " + std::to_string(rows[first]) +
                         ": " + why + " (" + std::to_string(neighbours) +
                         " neighbours, reciprocal condition number " + shortest(rcond) + "); " +
                         std::to_string(count) + " of " + std::to_string(rows.size()) +
                         " rows are degenerate",
                     rows[first], neighbours, rcond);
}

}  // namespace

int RowReport::degenerate() const {
  return static_cast<int>(outcome.size() - std::ranges::count(outcome, RowOutcome::AsAsked));
}

Operator assemble(const Scheme& scheme, const Cloud& cloud, const Neighbours& near,
                  const AssemblyOptions& options) {
  check(scheme, cloud, near, options);
  std::vector<int> rows;
  if (options.rows) {
    rows = *options.rows;
  } else {
    rows.resize(cloud.size());
    for (int i = 0; i < cloud.size(); ++i) rows[i] = i;
  }
  Eigen::VectorXd volumes =
      cloud.has_volumes() ? cloud.volumes()
                          : number_density_volumes(cloud, near, options.kernel, options.threads);

  Operator result = dispatch(cloud.dimension(), [&](auto d) {
    constexpr int D = decltype(d)::value;
    return scheme.derivative == Derivative::Gradient
               ? assemble<D, Derivative::Gradient>(scheme, cloud, near, volumes, rows, options)
               : assemble<D, Derivative::Laplacian>(scheme, cloud, near, volumes, rows, options);
  });
  if (options.on_degenerate == OnDegenerate::Fail)
    throw_if_degenerate(scheme, cloud.dimension(), rows, result.rows);
  result.volumes = std::move(volumes);
  return result;
}

}  // namespace gradpsi
