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

#include "base/cpu.hpp"
#include "base/dispatch.hpp"
#include "base/memory.hpp"
#include "base/parallel.hpp"
#include "base/resize.hpp"
#include "base/text.hpp"
#include "cloud/points.hpp"
#include "gradpsi/error.hpp"
#include "operators/assemble.hpp"
#include "operators/batch/batch.hpp"
#include "operators/batch/points.hpp"
#include "operators/moments.hpp"
#include "operators/positive.hpp"
#include "schemes/check.hpp"
#include "search/check.hpp"
#include "search/search.hpp"

namespace gradpsi {
namespace {

Phi phi(const Scheme& scheme, int d) {
  const bool gradient = scheme.derivative == Derivative::Gradient;
  switch (scheme.weight) {
    case Weight::Direct:
      return gradient ? Phi{.dw_over_q = -1} : Phi{.dw_over_q = d - 1.0, .d2w = 1};
    case Weight::Diffuse: return {.w_over_q2 = (gradient ? 1.0 : 2.0) * d};
    case Weight::DiffuseNs: return {.w_over_q = gradient ? 1.0 : 2.0};
    case Weight::Mixed: return {.dw_over_q = -2};
    case Weight::Kernel: return {.w = 1};
    case Weight::Distance: break;  // positive stencils have none
  }
  return {};
}

double value(const Phi& c, const Profile& p, double q) {
  double sum = c.w * p.w + c.dw_over_q * p.dw_over_q + c.d2w * p.d2w;
  if (c.w_over_q != 0) sum += c.w_over_q * (p.w / q);
  if (c.w_over_q2 != 0) sum += c.w_over_q2 * (p.w / (q * q));
  return sum;
}

/// Uncorrected weights lack h^2 (diffuse-ns: h); the gradient's r_ij = h s gives one h back.
int zoc_power(const Scheme& scheme) {
  return (scheme.weight == Weight::DiffuseNs ? 1 : 0) -
         (scheme.derivative == Derivative::Gradient ? 1 : 2);
}

/// Least squares whose system, its diagonal scaled to 1, has a smaller reciprocal condition number are
/// refined once, or twice.
constexpr double refined_below = 1e-4, refined_twice_below = 1e-9;

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
    const Phi c = phi(scheme, D);
    for (int k = 0; k < n_; ++k) weight(k) = value(c, kernel_.profile(q(k)), q(k));
    weight *= volume();
  }

  double zoc_factor(const Scheme& scheme) const {
    double factor = 1;
    for (int n = 0; n > zoc_power(scheme); --n) factor /= h_;
    return factor;
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
    const int rounds = scaled_reciprocal > refined_below         ? 1
                       : scaled_reciprocal > refined_twice_below ? 2
                                                                 : 3;
    for (int round = 0; round < rounds; ++round) {
      if (round > 0) lacking = right_hand_side<m>() - p.matrix().transpose() * weights().matrix();
      combine<m>(p, inverse.matrix * lacking);
    }
    return {1 / (one_norm<m>(M) * one_norm<m>(inverse.matrix)),
            scaled_reciprocal >= singular_below};
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

/// Refuses supports so large that weights, 1/h or 1/h^2, would vanish or lose digits.
void check_unit(const Scheme& scheme, const Eigen::VectorXd& supports) {
  if (supports.size() == 0) return;
  const double h = supports.maxCoeff();
  const bool gradient = scheme.derivative == Derivative::Gradient;
  if (1 / h / (gradient ? 1 : h) < std::numeric_limits<double>::min())
    throw InvalidInput("with support " + shortest(h) + " the weights of a " +
                       std::string(name(scheme.derivative)) + ", about 1/support" +
                       (gradient ? "" : "^2") + ", are below the range of a double");
}

/// Refuses what an int cannot count.
void check_entries(std::int64_t entries) {
  if (entries > std::numeric_limits<int>::max())
    throw InvalidInput("the rows would have " + std::to_string(entries) +
                       " entries, more than 2^31 - 1");
}

/// The neighbours of `rows` plus the diagonal, compressed; the values are left as they come.
void set_pattern(SparseMatrix& matrix, const Neighbours& near, const std::vector<int>* rows,
                 int threads) {
  const int m = rows ? static_cast<int>(rows->size()) : near.size();
  matrix.resize(m, near.size());
  int* const outer = matrix.outerIndexPtr();
  for (int k = 0; k < m; ++k) outer[k + 1] = outer[k] + near.count(rows ? (*rows)[k] : k) + 1;
  resize_in_large_pages(matrix, outer[m]);
  parallel_chunks(m, 1024, threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const int i = rows ? (*rows)[k] : k;
      int* const column = matrix.innerIndexPtr() + outer[k];
      int before = 0, l = 0;
      for (const int j : near.of(i)) {
        column[l++ + (j > i)] = j;
        before += j < i;
      }
      column[before] = i;
    }
  });
}

/// The same for another matrix.
void copy_pattern(SparseMatrix& matrix, const SparseMatrix& other, int threads) {
  matrix.resize(other.rows(), other.cols());
  const int m = static_cast<int>(other.rows());
  const int* const outer = other.outerIndexPtr();
  std::copy_n(outer, m + 1, matrix.outerIndexPtr());
  resize_in_large_pages(matrix, outer[m]);
  parallel_chunks(m, 8192, threads, [&](int begin, int end) {
    std::copy(other.innerIndexPtr() + outer[begin], other.innerIndexPtr() + outer[end],
              matrix.innerIndexPtr() + outer[begin]);
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

/// The rows of what is to be assembled: those asked for, or all.
struct Rows {
  const std::vector<int>* chosen;  // null: all
  int count;
  int point(int k) const { return chosen ? (*chosen)[k] : k; }
};

/// A row with more neighbours than there were to begin with.
struct WidenedRow {
  std::vector<int> columns;    // with the diagonal; empty: could not be solved
  std::vector<double> values;  // axis by axis
};
using WidenedRows = std::map<int, WidenedRow>;

/// Solves the rows that are zero with ever larger supports.
template <int D, Derivative Which>
WidenedRows widen(const Scheme& scheme, const Cloud& cloud, const Eigen::VectorXd& volumes,
                  const Rows& rows, const AssemblyOptions& options, RowReport& report) {
  constexpr double step = 1.2;
  double most = std::numeric_limits<double>::infinity();
  for (const double length : cloud.box())
    if (length > 0) most = std::min(most, length / 2);
  std::vector<int> zero;
  for (int k = 0; k < rows.count; ++k)
    if (report.outcome[k] == RowOutcome::Zero) zero.push_back(k);

  WidenedRows solved;
  for (double factor = step; factor <= widest && !zero.empty(); factor *= step) {
    const int count = static_cast<int>(zero.size());
    std::vector<int> points(count);
    Eigen::VectorXd supports(count);
    for (int z = 0; z < count; ++z) {
      points[z] = rows.point(zero[z]);
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

/// Operators to be computed in one pass, on one pattern.
struct Request {
  const Scheme* scheme;
  Operator* op;
};

/// The row's system as the vector code has it; nothing for those that it has no form for.
std::optional<BatchSystem> batch_system(const Scheme& scheme, int d) {
  BatchSystem system{};
  system.phi = phi(scheme, d);
  system.limit = singular_below;
  switch (scheme.consistency) {
    case Consistency::Zoc:
      system.form = Form::Zoc;
      system.zoc_power = zoc_power(scheme);
      break;
    case Consistency::Foc: system.form = Form::Linear; break;
    case Consistency::Soc:
      system.form = scheme.derivative == Derivative::Gradient ? Form::Quadratic : Form::Directions;
      break;
    case Consistency::SocLs:
    case Consistency::Ls1:
    case Consistency::Ls2:
      system.form = scheme.consistency == Consistency::Ls1 ? Form::Linear : Form::Quadratic;
      system.least_squares = true;
      system.limit = refined_below;
      break;
    default:
      if (scheme.weight != Weight::Kernel || degree(scheme) > highest_batched_degree(d))
        return std::nullopt;
      system.form = Form::Monomials;
      system.degree = degree(scheme);
      system.least_squares = true;
      system.limit = refined_twice_below;
  }
  return system;
}

/// The systems to be solved for the requests, and which request is answered by which.
struct Systems {
  std::vector<BatchSystem> systems;
  std::vector<int> of_request;  // -1: none
};

Systems systems(const std::vector<Request>& requests, int d) {
  Systems result;
  for (const auto& [scheme, op] : requests) {
    auto system = batch_system(*scheme, d);
    result.of_request.push_back(-1);
    if (!system) continue;
    const bool gradient = scheme->derivative == Derivative::Gradient;
    // A gradient and a Laplacian of the same least-squares system are solved together.
    auto& all = result.systems;
    auto found = std::ranges::find_if(all, [&](const BatchSystem& other) {
      return system->form != Form::Zoc && other.form == system->form &&
             other.degree == system->degree && other.phi == system->phi &&
             other.least_squares == system->least_squares &&
             (gradient ? !other.gradient[0] : !other.laplacian);
    });
    if (found == all.end()) found = all.insert(all.end(), *system);
    if (gradient)
      for (int a = 0; a < d; ++a) found->gradient[a] = op->axes[a].valuePtr();
    else
      found->laplacian = op->axes[0].valuePtr();
    if (!found->reciprocal_condition)
      found->reciprocal_condition = op->rows.reciprocal_condition.data();
    result.of_request.back() = static_cast<int>(found - all.begin());
  }
  return result;
}

constexpr int rows_per_chunk = 512;

/// What a thread needs to compute rows; a copy has memory of its own.
template <int D>
class RowWorker {
 public:
  RowWorker(const Cpu* vector_code, const std::vector<Request>& requests, const Cloud& cloud,
            const Neighbours& near, const Eigen::VectorXd& volumes, const Rows& rows,
            const AssemblyOptions& options)
      : vector_code_(vector_code),
        requests_(requests),
        cloud_(cloud),
        near_(near),
        volumes_(volumes),
        rows_(rows),
        // Points that are near one another in turn, so that what they share is still in the cache.
        order_(rows.chosen || near.order.size() == 0 ? nullptr : near.order.data()),
        points_(batch_points(cloud, near, options.kernel, volumes)),
        plan_(vector_code ? systems(requests, D)
                          : Systems{{}, std::vector<int>(requests.size(), -1)}),
        solved_(plan_.systems.size() * rows_per_chunk),
        gradient_(options.kernel),
        laplacian_(options.kernel) {
    const SparseMatrix& pattern = requests.front().op->axes.front();
    pattern_ = {pattern.outerIndexPtr(), pattern.innerIndexPtr(),
                rows.chosen ? rows.chosen->data() : nullptr};
    for (const Request& request : requests)
      ladders_.push_back(ladder(*request.scheme, options.on_degenerate));
  }

  /// Computes up to rows_per_chunk rows of all requests, and their reports.
  void operator()(int begin, int end) {
    solve_together(begin, end);
    for (std::size_t r = 0; r < requests_.size(); ++r)
      for (int n = begin; n < end; ++n) finish(static_cast<int>(r), row(n), n - begin);
  }

 private:
  int row(int n) const { return order_ ? order_[n] : n; }

  void solve_together(int begin, int end) {
    if (plan_.systems.empty()) return;
    int most = 0;
    for (int n = begin; n < end; ++n)
      most = std::max(most, pattern_.outer[row(n) + 1] - pattern_.outer[row(n)]);
    for (std::size_t s = 0; s < plan_.systems.size(); ++s)
      plan_.systems[s].solved = solved_.data() + s * rows_per_chunk;
    batch_kernels(*vector_code_)
        .solve[D - 1](points_, pattern_, order_ ? order_ + begin : nullptr, begin, end - begin,
                      plan_.systems.data(), static_cast<int>(plan_.systems.size()), most,
                      memory_.doubles(batch_memory(D, most)));
  }

  /// Reports row k of request r, the chunk's n-th; computes it by itself if that has not been done.
  void finish(int r, int k, int n) {
    const Request& request = requests_[r];
    RowReport& report = request.op->rows;
    const int i = rows_.point(k), s = plan_.of_request[r];
    report.neighbours[k] = near_.count(i);
    report.supports[k] = near_.support(i);
    if (s >= 0 && solved_[s * rows_per_chunk + n]) {
      report.reciprocal_condition[k] = plan_.systems[s].reciprocal_condition[k];
      report.outcome[k] = RowOutcome::AsAsked;
      report.degree[k] = degree(*request.scheme);
    } else if (request.scheme->derivative == Derivative::Gradient) {
      solve_alone(gradient_, request, ladders_[r], i, k);
    } else {
      solve_alone(laplacian_, request, ladders_[r], i, k);
    }
  }

  template <Derivative Which>
  void solve_alone(Row<D, Which>& row, const Request& request, const std::vector<Scheme>& steps,
                   int i, int k) {
    const auto neighbours = near_.of(i);
    row.gather(cloud_, neighbours, near_.support(i), volumes_, i);
    solve_row(row, steps, request.op->rows, k);
    for (int axis = 0; axis < Row<D, Which>::K; ++axis)
      write_axis(row, neighbours, i, axis, request.op->axes[axis].valuePtr() + pattern_.outer[k]);
  }

  const Cpu* vector_code_;
  const std::vector<Request>& requests_;
  const Cloud& cloud_;
  const Neighbours& near_;
  const Eigen::VectorXd& volumes_;
  Rows rows_;
  const int* order_;
  BatchPoints points_;
  BatchRows pattern_;
  Systems plan_;
  std::vector<unsigned char> solved_;  // by system, of the chunk's rows
  std::vector<std::vector<Scheme>> ladders_;
  Row<D, Derivative::Gradient> gradient_;
  Row<D, Derivative::Laplacian> laplacian_;
  LaneMemory memory_;
};

/// Computes the values of all requests, whose matrices have their pattern, and their row reports.
void fill(const Cpu* vector_code, const std::vector<Request>& requests, const Cloud& cloud,
          const Neighbours& near, const Eigen::VectorXd& volumes, const Rows& rows,
          const AssemblyOptions& options) {
  dispatch(cloud.dimension(), [&](auto d) {
    parallel_chunks(
        rows.count, rows_per_chunk, options.threads,
        RowWorker<decltype(d)::value>(vector_code, requests, cloud, near, volumes, rows, options));
  });
}

void check(const Scheme& scheme, const Cloud& cloud, const Neighbours& near,
           const AssemblyOptions& options) {
  static_cast<void>(Scheme(name(scheme)));  // throws unless it is one of schemes()
  checked_threads(options.threads);
  check_match(cloud, near);
  check_kernel(options.kernel, cloud.dimension());
  check_unit(scheme, near.supports);
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

void throw_if_degenerate(const Scheme& scheme, const Cloud& cloud, const Rows& rows,
                         const RowReport& report) {
  const int count = report.degenerate();
  if (count == 0) return;
  const auto first =
      std::ranges::find_if(report.outcome, [](auto o) { return o != RowOutcome::AsAsked; }) -
      report.outcome.begin();
  const int neighbours = report.neighbours[first];
  const double rcond = report.reciprocal_condition[first];
  const int needed = unknowns(scheme, cloud.dimension());
  const std::string why =
      neighbours == 0       ? "it has no neighbour"
      : neighbours < needed ? "at least " + std::to_string(needed) + " neighbours are needed"
      : scheme.consistency == Consistency::Positive ? "none of its stencils is positive"
      : rcond >= singular_below                     ? "its weights are not finite"
                                                    : "its moment system is singular";
  throw StencilError(name(scheme) + " cannot be computed at point " +
                         std::to_string(cloud.number(rows.point(static_cast<int>(first)))) + ": " +
                         why + " (" + std::to_string(neighbours) +
                         " neighbours, reciprocal condition number " + shortest(rcond) + "); " +
                         std::to_string(count) + " of " + std::to_string(rows.count) +
                         " rows are degenerate",
                     rows.point(static_cast<int>(first)), neighbours, rcond);
}

Rows chosen_rows(const AssemblyOptions& options, const Cloud& cloud) {
  if (!options.rows) return {nullptr, cloud.size()};
  return {&*options.rows, static_cast<int>(options.rows->size())};
}

std::vector<Request> requests(const std::vector<Scheme>& schemes,
                              std::vector<Operator>& operators) {
  std::vector<Request> result;
  for (std::size_t r = 0; r < schemes.size(); ++r) result.push_back({&schemes[r], &operators[r]});
  return result;
}

/// Widens the rows that are zero if so wished; removes what positive stencils do not need.
template <int D, Derivative Which>
void widen_and_prune(const Scheme& scheme, const Cloud& cloud, const Rows& rows,
                     const AssemblyOptions& options, Operator& op) {
  if (options.on_degenerate == OnDegenerate::Widen)
    if (const auto widened = widen<D, Which>(scheme, cloud, op.volumes, rows, options, op.rows);
        !widened.empty())
      for (std::size_t axis = 0; axis < op.axes.size(); ++axis)
        op.axes[axis] = with_rows(op.axes[axis], widened, static_cast<int>(axis));
  if (scheme.consistency == Consistency::Positive)
    op.axes[0].prune([&](int k, int j, double a) { return a != 0 || j == rows.point(k); });
}

/// What remains to be done once the rows have been computed.
void finish(const Scheme& scheme, const Cloud& cloud, const Rows& rows,
            const AssemblyOptions& options, Operator& op) {
  if (options.on_degenerate == OnDegenerate::Fail)
    throw_if_degenerate(scheme, cloud, rows, op.rows);
  dispatch(cloud.dimension(), [&](auto d) {
    constexpr int D = decltype(d)::value;
    if (scheme.derivative == Derivative::Gradient)
      widen_and_prune<D, Derivative::Gradient>(scheme, cloud, rows, options, op);
    else
      widen_and_prune<D, Derivative::Laplacian>(scheme, cloud, rows, options, op);
  });
}

/// Throws unless the operator's matrices have the pattern that the new values need.
void check_pattern(const Scheme& scheme, const Cloud& cloud, const Neighbours& near,
                   const Rows& rows, const Operator& op, const AssemblyOptions& options) {
  const std::size_t axes = scheme.derivative == Derivative::Gradient ? cloud.dimension() : 1;
  if (scheme.consistency == Consistency::Positive)
    throw InvalidInput("the pattern of laplacian-positive depends on its values: assemble it anew");
  if (options.on_degenerate == OnDegenerate::Widen)
    throw InvalidInput("rows of a given pattern cannot be widened: assemble them anew");
  if (op.axes.size() != axes)
    throw InvalidInput(name(scheme) + " has " + std::to_string(axes) + " matrices here, not " +
                       std::to_string(op.axes.size()));
  for (const SparseMatrix& matrix : op.axes) {
    bool same = matrix.isCompressed() && matrix.rows() == rows.count &&
                matrix.cols() == cloud.size() && std::ssize(op.rows.outcome) == rows.count;
    for (int k = 0; same && k < rows.count; ++k)
      same = matrix.outerIndexPtr()[k + 1] - matrix.outerIndexPtr()[k] ==
             near.count(rows.point(k)) + 1;
    if (!same) throw InvalidInput("the operator was not assembled with these neighbours and rows");
  }
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
  return std::move(assemble(std::vector<Scheme>{scheme}, cloud, near, options).front());
}

std::vector<Operator> assemble(const std::vector<Scheme>& schemes, const Cloud& cloud,
                               const Neighbours& near, const AssemblyOptions& options) {
  return assemble_with(&cpu(), schemes, cloud, near, options);
}

std::vector<Operator> assemble_with(const Cpu* vector_code, const std::vector<Scheme>& schemes,
                                    const Cloud& cloud, const Neighbours& near,
                                    const AssemblyOptions& options) {
  for (const Scheme& scheme : schemes) check(scheme, cloud, near, options);
  std::vector<Operator> operators(schemes.size());
  if (schemes.empty()) return operators;
  const Rows rows = chosen_rows(options, cloud);
  operators.front().volumes =
      cloud.has_volumes() ? cloud.volumes()
                          : number_density_volumes(cloud, near, options.kernel, options.threads);
  const Eigen::VectorXd& volumes = operators.front().volumes;
  for (std::size_t r = 0; r < schemes.size(); ++r) {
    operators[r].axes.resize(schemes[r].derivative == Derivative::Gradient ? cloud.dimension() : 1);
    for (SparseMatrix& matrix : operators[r].axes)
      if (const SparseMatrix& first = operators.front().axes.front(); &matrix == &first)
        set_pattern(matrix, near, rows.chosen, options.threads);
      else
        copy_pattern(matrix, first, options.threads);
    operators[r].rows = empty_report(rows.count);
    if (rows.chosen) operators[r].points = *rows.chosen;
    if (r > 0) operators[r].volumes = volumes;
  }
  fill(vector_code, requests(schemes, operators), cloud, near, volumes, rows, options);
  for (std::size_t r = 0; r < schemes.size(); ++r)
    finish(schemes[r], cloud, rows, options, operators[r]);
  return operators;
}

void reassemble(const Scheme& scheme, const Cloud& cloud, const Neighbours& near, Operator& op,
                const AssemblyOptions& options) {
  check(scheme, cloud, near, options);
  const Rows rows = chosen_rows(options, cloud);
  check_pattern(scheme, cloud, near, rows, op, options);
  if (cloud.has_volumes()) {
    resize(op.volumes, cloud.size());
    op.volumes = cloud.volumes();
  } else {
    const Eigen::VectorXd volumes =
        number_density_volumes(cloud, near, options.kernel, options.threads);
    resize(op.volumes, cloud.size());
    op.volumes = volumes;  // copied, not moved: others may have views of the numbers that are there
  }
  fill(&cpu(), {{&scheme, &op}}, cloud, near, op.volumes, rows, options);
  finish(scheme, cloud, rows, options, op);
}

}  // namespace gradpsi
