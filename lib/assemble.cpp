#include "gradpsi/assemble.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <utility>

#include "check.hpp"
#include "dispatch.hpp"
#include "gradpsi/error.hpp"
#include "moments.hpp"
#include "parallel.hpp"
#include "points.hpp"
#include "positive.hpp"
#include "search.hpp"
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
    case Weight::Kernel: return p.w;
    case Weight::Distance: return 0;  // positive stencils have none
  }
  return 0;
}

/// How a row was solved.
struct Solution {
  double reciprocal_condition = 0;  // see RowReport
  bool solved = false;
};

/// One row of an operator. Its memory is used again for the next row.
template <int D, Derivative Which>
class Row {
 public:
  static constexpr int K = Which == Derivative::Gradient ? D : 1;  // numbers per neighbour

  explicit Row(const Kernel& kernel) : kernel_(kernel) {}

  /// Takes up the neighbours of point i within `support`.
  void gather(const Cloud& cloud, std::span<const int> neighbours, double support,
              const Eigen::VectorXd& volumes, int i) {
    n_ = static_cast<int>(neighbours.size());
    h_ = support;
    const double per_h = 1 / h_;
    Columns s = this->s(), q = this->q(), volume = this->volume();
    for (int k = 0; k < n_; ++k) {
      s.row(k) = displacement<D>(cloud, i, neighbours[k]) * per_h;
      volume(k) = volumes[neighbours[k]];
    }
    q = s.square().rowwise().sum().sqrt().min(1);  // rounding can lift a neighbour past the support
    // One h at a time: 1 / h^d may be beyond a double where omega / h^d is not.
    for (int a = 0; a < D; ++a) volume *= per_h;
    volume *= kernel_.normalisation[D - 1];
  }

  /// Computes the weights a_ij of a scheme.
  Solution solve(const Scheme& scheme) {
    if (n_ == 0) return {};
    if (scheme.consistency != Consistency::Positive) weigh(scheme);
    Solution solution;
    if constexpr (Which == Derivative::Gradient)
      solution = solve_gradient(scheme);
    else
      solution = solve_laplacian(scheme);
    solution.solved &= sums_.isFinite().all();
    return solution;
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
  Columns volume() { return volume_.columns(n_, 1); }  // omega_j s_d / h^d
  Columns weight() { return weight_.columns(n_, 1); }  // omega_j phi(r), but for zoc_factor()

  void weigh(const Scheme& scheme) {
    Columns weight = this->weight(), q = this->q();
    for (int k = 0; k < n_; ++k) weight(k) = scaled_phi(scheme, D, kernel_.profile(q(k)), q(k));
    weight *= volume();
  }

  /// scaled_phi lacks h^2 (diffuse-ns: h); the gradient's r_ij = h s gives one h back.
  double zoc_factor(const Scheme& scheme) const {
    return (scheme.weight == Weight::DiffuseNs ? h_ : 1) /
           (Which == Derivative::Gradient ? h_ : h_ * h_);
  }

  Solution solve_gradient(const Scheme& scheme) {
    switch (scheme.consistency) {
      case Consistency::Zoc: return emit<Linear<D>>(zoc_factor(scheme) * Matrix<D, K>::Identity());
      case Consistency::Foc: return correct<Linear<D>, Linear<D>>(Matrix<D, K>::Identity() / h_);
      case Consistency::Soc:
        return correct<Quadratic<D>, Quadratic<D>>(Matrix<quadratic_size<D>, K>::Identity() / h_);
      default: return least_squares(degree(scheme));
    }
  }

  Solution solve_laplacian(const Scheme& scheme) {
    switch (scheme.consistency) {
      case Consistency::Zoc: return emit<Constant<D>>(Matrix<1, 1>(zoc_factor(scheme)));
      case Consistency::Soc:
        return correct<Quadratic<D>, Directions<D>>(right_hand_side<quadratic_size<D>>());
      case Consistency::Positive: return positive();
      default: return least_squares(degree(scheme));
    }
  }

  /// What the moments of the weights are to be: gradient 1 / h for s_a, Laplacian 2 / h^2 for s_a^2.
  template <int M>
  Matrix<M, K> right_hand_side() const {
    Matrix<M, K> rhs = Matrix<M, K>::Zero();
    for (int a = 0; a < D; ++a)
      if constexpr (Which == Derivative::Gradient)
        rhs(a, a) = 1 / h_;
      else if constexpr (M >= quadratic_size<D>)
        rhs(diagonal_row<D>(a), 0) = 2 / (h_ * h_);
    return rhs;
  }

  /// Solves (sum w p t^T) C = rhs and sets the weights w_j C^T t_j.
  template <class Test, class Trial>
  Solution correct(const Matrix<Trial::size, K>& rhs) {
    constexpr int m = Trial::size;
    constexpr bool definite = std::is_same_v<Test, Trial>;  // and all w_j > 0
    if (n_ < m) return {};
    const Columns t = trial_.columns(n_, m);
    Trial::fill(s(), q(), t);
    const Columns p = definite ? t : test_.columns(n_, m);
    if (!definite) Test::fill(s(), q(), p);
    const auto inverse =
        invert<definite>(moments<definite, m>(weight(), p, t, weighted_.columns(n_, m)));
    weights().setZero();
    combine<m>(t, inverse.matrix * rhs);
    return {inverse.reciprocal_condition, inverse.reciprocal_condition >= singular_below};
  }

  Solution least_squares(int degree) {
    switch (degree) {
      case 1: return least_squares<1>();
      case 2: return least_squares<2>();
      case 3: return least_squares<3>();
      case 4: return least_squares<4>();
      case 5: return least_squares<5>();
      default: return least_squares<6>();
    }
  }

  /// The weights w_j C^T p_j, p the monomials to degree P, that reproduce these: of all such weights those
  /// with the least sum a^2 / w. The normal equations with their diagonal scaled to 1 determine C; their
  /// rounding, up to 1e-16 times the condition, goes into a second and third round, for what the weights'
  /// own moments still lack. That leaves the error of an orthogonal factorisation.
  template <int P>
  Solution least_squares() {
    constexpr int m = Monomials<D, P>::size;
    if (n_ < m) return {};
    const Columns p = trial_.columns(n_, m);
    Monomials<D, P>::fill(s(), q(), p);
    weight() = weight().abs();
    const Matrix<m, m> M = moments<true, m>(weight(), p, p, weighted_.columns(n_, m));
    const Matrix<m, 1> scale = M.diagonal().cwiseSqrt().cwiseInverse();
    auto inverse = invert<true, m>(scale.asDiagonal() * M * scale.asDiagonal());
    const double scaled_reciprocal = inverse.reciprocal_condition;
    if (scaled_reciprocal == 0) return {};
    inverse.matrix = scale.asDiagonal() * inverse.matrix * scale.asDiagonal();

    weights().setZero();
    Matrix<m, K> lacking = right_hand_side<m>();
    const int rounds = scaled_reciprocal > 1e-4 ? 1 : scaled_reciprocal > 1e-9 ? 2 : 3;
    for (int round = 0; round < rounds; ++round) {
      if (round > 0) lacking = right_hand_side<m>() - p.matrix().transpose() * weights().matrix();
      combine<m>(p, inverse.matrix * lacking);
    }
    return {1 / (one_norm(M) * one_norm(inverse.matrix)), scaled_reciprocal >= singular_below};
  }

  Solution positive() {
    Columns psi = weights();
    const double reciprocal_condition = stencil_.solve(s(), q(), psi);
    psi /= h_ * h_;
    sums_[0] = psi.sum();
    return {reciprocal_condition, reciprocal_condition > 0};
  }

  template <class Trial>
  Solution emit(const Matrix<Trial::size, K>& C) {
    const Columns t = trial_.columns(n_, Trial::size);
    Trial::fill(s(), q(), t);
    weights().setZero();
    combine<Trial::size>(t, C);
    return {1, true};
  }

  /// Adds w_j C^T t_j to the weights, and sums them.
  template <int M>
  void combine(const Columns& t, const Matrix<M, K>& C) {
    Columns a = weights(), sum = sum_.columns(n_, 1);
    for (int c = 0; c < K; ++c) {
      sum = C(0, c) * t.col(0);
      for (int l = 1; l < M; ++l) sum += C(l, c) * t.col(l);
      a.col(c) += sum.col(0) * weight().col(0);
      sums_[c] = a.col(c).sum();
    }
  }

  Kernel kernel_;
  int n_ = 0;     // neighbours
  double h_ = 0;  // support
  Buffer s_, q_, volume_, weight_, trial_, test_, weighted_, weights_, sum_;
  PositiveStencil<D> stencil_;
  Eigen::Array<double, K, 1> sums_;
};

/// The scheme of the next lower consistency, for rows that cannot be solved; none below zoc.
std::optional<Scheme> lowered(const Scheme& scheme) {
  const bool gradient = scheme.derivative == Derivative::Gradient;
  const auto same_weight = [&](Consistency consistency) {
    return Scheme(scheme.derivative, scheme.weight, consistency);
  };
  switch (scheme.consistency) {
    case Consistency::Zoc: return std::nullopt;
    case Consistency::Soc: return same_weight(gradient ? Consistency::Foc : Consistency::Zoc);
    case Consistency::Foc:
    case Consistency::SocLs: return same_weight(Consistency::Zoc);
    default: break;
  }
  if (scheme.weight == Weight::Kernel && degree(scheme) > (gradient ? 1 : 2))
    return same_weight(static_cast<Consistency>(static_cast<int>(scheme.consistency) - 1));
  return Scheme(scheme.derivative, gradient ? Weight::Direct : Weight::Mixed, Consistency::Zoc);
}

/// The schemes to try for a row, best first.
std::vector<Scheme> ladder(const Scheme& scheme, OnDegenerate policy) {
  std::vector<Scheme> steps = {scheme};
  if (policy == OnDegenerate::Lower)
    while (const auto next = lowered(steps.back())) steps.push_back(*next);
  return steps;
}

RowReport empty_report(int rows) {
  return {Eigen::VectorXi(rows), Eigen::VectorXd(rows), Eigen::VectorXd(rows),
          std::vector<RowOutcome>(rows), Eigen::VectorXi(rows)};
}

/// Solves row i by the first scheme that can be, else leaves it zero, and reports it as row k.
template <class Row>
void solve_row(Row& row, const std::vector<Scheme>& steps, RowReport& report, int k) {
  report.outcome[k] = RowOutcome::Zero;
  report.degree[k] = -1;
  for (const Scheme& step : steps) {
    const bool asked = step == steps.front();
    const Solution solution = row.solve(step);
    if (asked) report.reciprocal_condition[k] = solution.reciprocal_condition;
    if (!solution.solved) continue;
    report.outcome[k] = asked ? RowOutcome::AsAsked : RowOutcome::Lowered;
    report.degree[k] = degree(step);
    return;
  }
  row.set_zero();
}

/// Refuses what an int cannot count.
void check_entries(std::int64_t entries) {
  if (entries > std::numeric_limits<int>::max())
    throw InvalidInput("the rows would have " + std::to_string(entries) +
                       " entries, more than 2^31 - 1");
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

/// Writes one axis of row i, whose neighbours ascend, the diagonal in its place.
template <class Row>
void write_axis(Row& row, std::span<const int> neighbours, int i, int axis, double* entry) {
  const auto before = std::ranges::lower_bound(neighbours, i) - neighbours.begin();
  const double* const a = row.weights().col(axis).data();
  entry = std::copy_n(a, before, entry);
  *entry++ = 0 - row.sums()[axis];  // 0, not -0, in a row left zero
  std::copy(a + before, a + neighbours.size(), entry);
}

/// A row with more neighbours than there were to begin with.
struct WidenedRow {
  std::vector<int> columns;    // with the diagonal; empty: could not be solved
  std::vector<double> values;  // axis by axis
};
using WidenedRows = std::map<int, WidenedRow>;

/// Solves the rows that are zero with ever larger supports.
template <int D, Derivative Which>
WidenedRows widen(const Scheme& scheme, const Cloud& cloud, const Eigen::VectorXd& volumes,
                  const std::vector<int>& rows, const AssemblyOptions& options, RowReport& report) {
  constexpr double step = 1.2;
  double most = std::numeric_limits<double>::infinity();
  for (const double length : cloud.box())
    if (length > 0) most = std::min(most, length / 2);
  std::vector<int> zero;
  for (int k = 0; k < static_cast<int>(rows.size()); ++k)
    if (report.outcome[k] == RowOutcome::Zero) zero.push_back(k);

  WidenedRows solved;
  for (double factor = step; factor <= widest && !zero.empty(); factor *= step) {
    const int count = static_cast<int>(zero.size());
    std::vector<int> points(count);
    Eigen::VectorXd supports(count);
    for (int z = 0; z < count; ++z) {
      points[z] = rows[zero[z]];
      supports[z] = std::min(factor * report.supports[zero[z]], most);
    }
    const Neighbours near = neighbours_around(cloud, points, supports, options.threads);
    std::vector<WidenedRow> widened(count);
    RowReport tried = empty_report(count);
    parallel_chunks(count, 16, options.threads,
                    [&, row = Row<D, Which>(options.kernel)](int begin, int end) mutable {
                      for (int z = begin; z < end; ++z) {
                        const auto neighbours = near.of(z);
                        const int i = points[z];
                        row.gather(cloud, neighbours, supports[z], volumes, i);
                        solve_row(row, {scheme}, tried, z);
                        if (tried.outcome[z] == RowOutcome::Zero) continue;
                        auto& [columns, values] = widened[z];
                        columns.assign(neighbours.begin(), neighbours.end());
                        columns.insert(std::ranges::lower_bound(columns, i), i);
                        values.resize(Row<D, Which>::K * columns.size());
                        for (int axis = 0; axis < Row<D, Which>::K; ++axis)
                          write_axis(row, neighbours, i, axis,
                                     values.data() + axis * columns.size());
                      }
                    });
    std::vector<int> still;
    for (int z = 0; z < count; ++z) {
      const int k = zero[z];
      if (widened[z].columns.empty()) {
        still.push_back(k);
        continue;
      }
      report.neighbours[k] = near.count(z);
      report.reciprocal_condition[k] = tried.reciprocal_condition[z];
      report.outcome[k] = RowOutcome::Widened;
      report.degree[k] = tried.degree[z];
      report.supports[k] = supports[z];
      solved.emplace(k, std::move(widened[z]));
    }
    zero = std::move(still);
  }
  return solved;
}

/// The matrix with those rows in place of its own.
SparseMatrix with_rows(const SparseMatrix& matrix, const WidenedRows& replaced, int axis) {
  std::int64_t entries = matrix.nonZeros();
  for (const auto& [k, row] : replaced)
    entries += static_cast<std::int64_t>(row.columns.size()) - matrix.row(k).nonZeros();
  check_entries(entries);
  SparseMatrix result(matrix.rows(), matrix.cols());
  result.resizeNonZeros(entries);
  int* column = result.innerIndexPtr();
  double* value = result.valuePtr();
  for (int k = 0; k < matrix.rows(); ++k) {
    if (const auto found = replaced.find(k); found != replaced.end()) {
      const auto& [columns, values] = found->second;
      column = std::ranges::copy(columns, column).out;
      value = std::copy_n(values.begin() + axis * std::ssize(columns), columns.size(), value);
    } else {
      const int begin = matrix.outerIndexPtr()[k], end = matrix.outerIndexPtr()[k + 1];
      column = std::copy(matrix.innerIndexPtr() + begin, matrix.innerIndexPtr() + end, column);
      value = std::copy(matrix.valuePtr() + begin, matrix.valuePtr() + end, value);
    }
    result.outerIndexPtr()[k + 1] = static_cast<int>(value - result.valuePtr());
  }
  return result;
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
  RowReport& report = result.rows = empty_report(m);

  parallel_chunks(m, 512, options.threads,
                  [&, row = Row<D, Which>(options.kernel),
                   steps = ladder(scheme, options.on_degenerate)](int begin, int end) mutable {
                    for (int k = begin; k < end; ++k) {
                      const int i = rows[k];
                      const auto neighbours = near.of(i);
                      row.gather(cloud, neighbours, near.support(i), volumes, i);
                      solve_row(row, steps, report, k);
                      report.neighbours[k] = near.count(i);
                      report.supports[k] = near.support(i);
                      for (int axis = 0; axis < K; ++axis)
                        write_axis(row, neighbours, i, axis,
                                   result.axes[axis].valuePtr() + offsets[k]);
                    }
                  });
  if (options.on_degenerate == OnDegenerate::Widen)
    if (const auto widened = widen<D, Which>(scheme, cloud, volumes, rows, options, report);
        !widened.empty())
      for (int axis = 0; axis < K; ++axis)
        result.axes[axis] = with_rows(result.axes[axis], widened, axis);
  if (scheme.consistency == Consistency::Positive)
    result.axes[0].prune([&](int k, int j, double a) { return a != 0 || j == rows[k]; });
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
  check_entries(entries);
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
  const std::string why =
      neighbours == 0       ? "it has no neighbour"
      : neighbours < needed ? "at least " + std::to_string(needed) + " neighbours are needed"
      : scheme.consistency == Consistency::Positive ? "none of its stencils is positive"
      : rcond >= singular_below                     ? "its weights are not finite"
                                                    : "its moment system is singular";
  throw StencilError(name(scheme) + " cannot be computed at point " + std::to_string(rows[first]) +
                         ": " + why + " (" + std::to_string(neighbours) +
                         " neighbours, reciprocal condition number " + shortest(rcond) + "); " +
                         std::to_string(count) + " of " + std::to_string(rows.size()) +
                         " rows are degenerate",
                     rows[first], neighbours, rcond);
}

}  // namespace

std::string_view name(RowOutcome outcome) {
  static constexpr std::array<std::string_view, 4> names = {"as-asked", "lowered", "widened",
                                                            "zero"};
  return names.at(static_cast<std::size_t>(outcome));
}

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
