#include "gradpsi/interpolate.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "base/cpu.hpp"
#include "base/parallel.hpp"
#include "base/text.hpp"
#include "gradpsi/assemble.hpp"
#include "gradpsi/error.hpp"
#include "operators/assemble.hpp"
#include "operators/degenerate.hpp"
#include "schemes/check.hpp"
#include "schemes/recipe.hpp"
#include "search/probes.hpp"

namespace gradpsi {
namespace {

void check(const std::vector<Scheme>& schemes, const Cloud& cloud, const Kernel& kernel) {
  for (const Scheme& scheme : schemes)
    if (!recipe(scheme).fitted || recipe(scheme).form != Form::Monomials)
      throw InvalidInput(name(scheme) + " is not for probes: " +
                         std::string(name(scheme.derivative)) + "-mls-P is");
  check_kernel(kernel, cloud.dimension());
}

/// The points of the lists, ascending, then the probes: a cloud by themselves.
struct Both {
  std::vector<int> used;  // points of the given cloud
  Cloud cloud;
  Neighbours near;          // of the probes
  DenseVector volumes;      // the probes have none
  std::vector<int> probes;  // where they are
};

std::vector<int> used_points(const Neighbours& near, int points) {
  std::vector<char> marks(points, false);
  for (const int i : near.indices) marks[i] = true;
  std::vector<int> used;
  for (int i = 0; i < points; ++i)
    if (marks[i]) used.push_back(i);
  return used;
}

Cloud joined(const Cloud& cloud, const std::vector<int>& used, const Positions& probes) {
  const auto n = std::ssize(used), m = probes.rows();
  Positions x(n + m, probes.cols());
  x.topRows(n) = cloud.positions()(used, Eigen::all);
  x.bottomRows(m) = probes;
  return Cloud(std::move(x), {.box = cloud.box()});
}

Both both(const Cloud& cloud, const DenseVector& volumes, const Positions& probes,
          const Neighbours& near) {
  const auto used = used_points(near, cloud.size());
  const int n = static_cast<int>(used.size()), m = near.size();
  Both result{used, joined(cloud, used, probes), {}, DenseVector::Zero(n + m), std::vector<int>(m)};
  result.volumes.head(n) = volumes(used);
  std::iota(result.probes.begin(), result.probes.end(), n);
  std::vector<int> place(cloud.size());
  for (int k = 0; k < n; ++k) place[used[k]] = k;
  result.near.offsets = IndexVector::Zero(n + m + 1);
  result.near.offsets.tail(m) = near.offsets.tail(m);
  result.near.indices = near.indices;
  for (int& i : result.near.indices) i = place[i];
  result.near.supports = near.supports;
  if (near.supports.size() != 1) {
    result.near.supports = DenseVector::Ones(n + m);
    result.near.supports.tail(m) = near.supports;
  }
  return result;
}

/// The rows without their last entry, that of the probe itself, with the columns of the given cloud.
SparseMatrix without_probes(const SparseMatrix& A, const Both& both, int points, int threads) {
  const auto m = static_cast<int>(A.rows());
  SparseMatrix result(m, points);
  result.resizeNonZeros(A.nonZeros() - m);
  for (int k = 0; k <= m; ++k) result.outerIndexPtr()[k] = A.outerIndexPtr()[k] - k;
  parallel_chunks(m, 4096, threads, [&](int begin, int end) {
    for (int k = begin; k < end; ++k) {
      const int from = A.outerIndexPtr()[k], to = from - k,
                count = A.outerIndexPtr()[k + 1] - from - 1;
      for (int l = 0; l < count; ++l)
        result.innerIndexPtr()[to + l] = both.used[A.innerIndexPtr()[from + l]];
      std::copy_n(A.valuePtr() + from, count, result.valuePtr() + to);
    }
  });
  return result;
}

DenseVector volumes(const Cloud& cloud, const VectorView& supports,
                    const InterpolationOptions& options) {
  constexpr double ratio = 2.5;
  if (cloud.has_volumes() || cloud.size() == 0) return cloud.volumes();
  const DenseVector h = supports.size() > 0
                            ? DenseVector(supports)
                            : DenseVector(ratio * local_spacing(cloud, options.threads));
  return number_density_volumes(cloud, find_neighbours(cloud, h, options.threads), options.kernel,
                                options.threads);
}

/// With rows of zeros where there is none.
std::vector<Operator> at_probes(const std::vector<Scheme>& schemes, const Cloud& cloud,
                                const DenseVector& volumes, const Positions& probes,
                                const Neighbours& near, const InterpolationOptions& options) {
  const Both all = both(cloud, volumes, probes, near);
  std::vector<Operator> operators = assemble_with(&cpu(), schemes, all.cloud, all.near,
                                                  {.kernel = options.kernel,
                                                   .on_degenerate = OnDegenerate::Zero,
                                                   .rows = all.probes,
                                                   .threads = options.threads},
                                                  all.volumes);
  for (Operator& op : operators) {
    for (SparseMatrix& matrix : op.axes)
      matrix = without_probes(matrix, all, cloud.size(), options.threads);
    op.volumes = volumes;
    op.points.clear();
  }
  return operators;
}

/// As many points as each probe needs.
std::vector<Operator> at_nearest(const std::vector<Scheme>& schemes, const Cloud& cloud,
                                 const Positions& probes, const InterpolationOptions& options) {
  constexpr int for_each_unknown = 3, most_doublings = 3;
  int most_unknowns = cloud.dimension();
  for (const Scheme& scheme : schemes)
    most_unknowns = std::max(most_unknowns, unknowns(scheme, cloud.dimension()));
  std::vector<int> counts(probes.rows(), for_each_unknown * (most_unknowns + 1));
  Neighbours near = nearest_to_probes(cloud, probes, counts, options.threads);
  const DenseVector own = volumes(cloud, DenseVector(), options);
  auto operators = at_probes(schemes, cloud, own, probes, near, options);
  const auto double_degenerate = [&] {
    std::vector<int> more = counts;
    for (const Operator& op : operators)
      for (std::size_t k = 0; k < counts.size(); ++k)
        if (op.rows.outcome[k] != RowOutcome::AsAsked) more[k] = 2 * counts[k];
    return std::exchange(counts, more) != counts;
  };
  for (int n = 0; n < most_doublings && double_degenerate(); ++n) {
    near = nearest_to_probes(cloud, probes, counts, options.threads);
    operators = at_probes(schemes, cloud, own, probes, near, options);
  }
  return operators;
}

/// Rows of values, and of no derivative, sum to 1.
void check_values(const Operator& op) {
  constexpr double rounding = 1e-8;
  if (op.axes.size() != 1 || op.matrix().cols() != op.volumes.size())
    throw InvalidInput("a transfer takes the one matrix that interpolate(\"value-mls-P\") returns");
  const SparseMatrix& A = op.matrix();
  for (int k = 0; k < A.rows(); ++k) {
    double sum = 0, size = 0;
    for (SparseMatrix::InnerIterator a(A, k); a; ++a) sum += a.value(), size += std::abs(a.value());
    if (!(std::abs(sum - 1) <= rounding * size))
      throw InvalidInput("row " + std::to_string(k) + " sums up to " + shortest(sum) +
                         ", not to 1: a transfer takes value-mls-P");
  }
}

}  // namespace

Operator interpolate(const Scheme& scheme, const Cloud& cloud, const Positions& probes,
                     const VectorView& supports, const InterpolationOptions& options) {
  return std::move(
      interpolate(std::vector<Scheme>{scheme}, cloud, probes, supports, options).front());
}

std::vector<Operator> interpolate(const std::vector<Scheme>& schemes, const Cloud& cloud,
                                  const Positions& probes, const VectorView& supports,
                                  const InterpolationOptions& options) {
  if (schemes.empty()) return {};
  check(schemes, cloud, options.kernel);
  std::vector<Operator> operators;
  if (supports.size() > 0) {
    const Neighbours near = neighbours_of_probes(cloud, probes, supports, options.threads);
    operators = at_probes(schemes, cloud, volumes(cloud, supports, options), probes, near, options);
  } else {
    operators = at_nearest(schemes, cloud, probes, options);
  }
  const Cloud places(probes, {.box = cloud.box()});
  for (std::size_t r = 0; r < schemes.size(); ++r)
    throw_if_degenerate(schemes[r], places, {nullptr, places.size()}, operators[r], "probe");
  return operators;
}

SparseMatrix conservative_transfer(const Operator& value, const VectorView& probe_volumes) {
  check_values(value);
  const Eigen::Index m = value.matrix().rows();
  if (m != probe_volumes.size())
    throw InvalidInput("there are " + std::to_string(m) + " probes and the volumes of " +
                       std::to_string(probe_volumes.size()));
  for (Eigen::Index k = 0; k < m; ++k)
    if (!(probe_volumes[k] > 0 && std::isfinite(probe_volumes[k])))
      throw InvalidInput("the volume of probe " + std::to_string(k) +
                         " must be > 0 and finite, not " + shortest(probe_volumes[k]));
  SparseMatrix result = value.matrix().transpose();
  for (int i = 0; i < result.rows(); ++i)
    for (SparseMatrix::InnerIterator a(result, i); a; ++a)
      a.valueRef() *= probe_volumes[a.col()] / value.volumes[i];
  return result;
}

}  // namespace gradpsi
