#include "gradpsi/interpolate.hpp"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include "base/cpu.hpp"
#include "base/parallel.hpp"
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
  if (cloud.has_volumes() || cloud.size() == 0) return cloud.volumes();
  return number_density_volumes(cloud, find_neighbours(cloud, supports, options.threads),
                                options.kernel, options.threads);
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
  const Neighbours near = neighbours_of_probes(cloud, probes, supports, options.threads);
  const DenseVector own = volumes(cloud, supports, options);
  const Both all = both(cloud, own, probes, near);
  std::vector<Operator> operators = assemble_with(&cpu(), schemes, all.cloud, all.near,
                                                  {.kernel = options.kernel,
                                                   .on_degenerate = OnDegenerate::Zero,
                                                   .rows = all.probes,
                                                   .threads = options.threads},
                                                  all.volumes);
  const Cloud places(probes, {.box = cloud.box()});
  for (std::size_t r = 0; r < schemes.size(); ++r) {
    Operator& op = operators[r];
    throw_if_degenerate(schemes[r], places, {nullptr, places.size()}, op, "probe");
    for (SparseMatrix& matrix : op.axes)
      matrix = without_probes(matrix, all, cloud.size(), options.threads);
    op.volumes = own;
    op.points.clear();
  }
  return operators;
}

SparseMatrix conservative_transfer(const Operator& value, const VectorView& probe_volumes) {
  if (value.axes.size() != 1 || value.matrix().cols() != value.volumes.size() ||
      value.matrix().rows() != probe_volumes.size())
    throw InvalidInput("a transfer from " + std::to_string(probe_volumes.size()) +
                       " probes needs their values, one matrix of as many rows");
  SparseMatrix result = value.matrix().transpose();
  for (int i = 0; i < result.rows(); ++i)
    for (SparseMatrix::InnerIterator a(result, i); a; ++a)
      a.valueRef() *= probe_volumes[a.col()] / value.volumes[i];
  return result;
}

}  // namespace gradpsi
