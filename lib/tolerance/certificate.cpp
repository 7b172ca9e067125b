#include "tolerance/certificate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "base/dispatch.hpp"
#include "base/parallel.hpp"
#include "base/text.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/tolerance.hpp"
#include "schemes/targets.hpp"
#include "tolerance/bounds.hpp"
#include "tolerance/directions.hpp"

namespace gradpsi {
namespace {

double factorial(int m) { return m < 2 ? 1 : m * factorial(m - 1); }

/// The monomials of degree m.
std::vector<Monomial> monomials(int dimension, int m) {
  std::vector<Monomial> result;
  for (int a = m; a >= 0; --a)
    for (int b = m - a; b >= 0; --b) {
      const std::array<int, 3> powers = {a, b, m - a - b};
      if ((dimension < 2 && a < m) || (dimension < 3 && powers[2] > 0)) continue;
      Monomial& next = result.emplace_back();
      next.factorial = 1;
      for (int axis = 0; axis < 3; ++axis) {
        next.powers[axis] = powers[axis];
        next.factorial *= factorial(powers[axis]);
      }
    }
  return result;
}

/// Of the directions: directions x monomials.
std::vector<double> at_directions(int dimension, const std::vector<Monomial>& of_degree) {
  std::vector<double> result;
  for (const auto& axis : directions(dimension).axes.rowwise())
    for (const Monomial& monomial : of_degree) {
      double product = 1;
      for (int a = 0; a < dimension; ++a)
        for (int power = 0; power < monomial.powers[a]; ++power) product *= axis[a];
      result.push_back(product);
    }
  return result;
}

/// What does not depend on the derivative.
struct Degree {
  std::vector<Monomial> monomials;
  std::vector<double> at_directions;
};

constexpr int highest_degree(int dimension) { return dimension == 3 ? 10 : most_degrees - 1; }

template <int D>
const std::vector<Degree>& degrees() {
  static const std::vector<Degree> all = [] {
    std::vector<Degree> result;
    for (int m = 0; m <= highest_degree(D); ++m) {
      const std::vector<Monomial> of_degree = gradpsi::monomials(D, m);
      result.push_back({of_degree, gradpsi::at_directions(D, of_degree)});
    }
    return result;
  }();
  return all;
}

/// BoundTables, and the memory behind them.
class Tables {
 public:
  Tables(const Target& target, int dimension) : asked_(highest_degree(dimension) + 1) {
    const std::vector<Degree>& all = *dispatch(dimension, [](auto d) { return &degrees<d>(); });
    const int outputs = target.outputs(dimension);
    for (std::size_t m = 0; m < all.size(); ++m) {
      for (const Monomial& monomial : all[m].monomials)
        for (int o = 0; o < outputs; ++o)
          asked_[m].push_back(target.of(o, {monomial.powers, static_cast<std::size_t>(dimension)}));
      const double angle = static_cast<double>(m) * directions(dimension).apart;
      degrees_.push_back({static_cast<int>(all[m].monomials.size()), all[m].monomials.data(),
                          asked_[m].data(), all[m].at_directions.data(),
                          factorial(static_cast<int>(m)),
                          angle > std::numbers::pi / 3 ? std::numeric_limits<double>::infinity()
                                                       : 1 / std::cos(angle)});
    }
    of_all_ = {target.order, outputs, highest_degree(dimension),
               static_cast<int>(directions(dimension).axes.rows()), degrees_.data()};
  }
  Tables(const Tables&) = delete;
  Tables& operator=(const Tables&) = delete;

  const BoundTables& of_all() const { return of_all_; }

 private:
  std::vector<std::vector<double>> asked_;
  std::vector<DegreeTable> degrees_;
  BoundTables of_all_;
};

BoundRows bound_rows(const Cloud& cloud, const Operator& op, const VectorView& wavelengths,
                     double tolerance) {
  BoundRows rows{.x = cloud.positions().data(),
                 .box = {cloud.box()[0], cloud.box()[1], cloud.box()[2]},
                 .outer = op.matrix().outerIndexPtr(),
                 .inner = op.matrix().innerIndexPtr(),
                 .points = op.points.empty() ? nullptr : op.points.data(),
                 .values = {},
                 .wavelengths = wavelengths.data(),
                 .one_wavelength = wavelengths.size() == 1,
                 .tolerance = tolerance};
  for (std::size_t o = 0; o < op.axes.size(); ++o) rows.values[o] = op.axes[o].valuePtr();
  return rows;
}

void check(const Target& target, const Cloud& cloud, const Operator& op,
           const VectorView& wavelengths) {
  const int n = cloud.size(), outputs = target.outputs(cloud.dimension());
  if (std::ssize(op.axes) != outputs || op.matrix().cols() != n || op.normals.size() > 0 ||
      op.matrix().rows() != (op.points.empty() ? n : std::ssize(op.points)))
    throw InvalidInput("the operator is not a " + std::string(target.name) + " of these " +
                       std::to_string(n) + " points");
  check_wavelengths(target.order, n, wavelengths);
}

}  // namespace

void check_wavelengths(int order, int n, const VectorView& wavelengths) {
  if (wavelengths.size() != 1 && wavelengths.size() != n)
    throw InvalidInput(std::to_string(wavelengths.size()) + " wavelengths for " +
                       std::to_string(n) + " points: give one, or one a point");
  for (const double L : wavelengths)
    if (!(L > 0 && std::isfinite(L)) || !std::isnormal(std::pow(L, order)) ||
        !std::isnormal(std::pow(1 / L, order)))
      throw InvalidInput("wavelengths must be > 0 and finite, and so their powers, not " +
                         shortest(L));
}

DenseVector bounded_errors(Derivative derivative, const Cloud& cloud, const Operator& op,
                           const VectorView& wavelengths, double tolerance, int threads,
                           const Cpu& processor) {
  const Tables tables(target(derivative), cloud.dimension());
  const SparseMatrix& pattern = op.matrix();
  const BoundRows rows = bound_rows(cloud, op, wavelengths, tolerance);
  const int* const outer = pattern.outerIndexPtr();
  const BoundFunction bound = bound_kernels(processor).of[cloud.dimension() - 1];
  DenseVector errors(pattern.rows());
  parallel_chunks(
      static_cast<int>(pattern.rows()), 256, threads,
      [&, some = std::vector<int>(), memory = std::vector<double>()](int begin, int end) mutable {
        some.clear();
        int longest = 0;
        for (int k = begin; k < end; ++k) {
          errors[k] = std::numeric_limits<double>::infinity();
          if (op.rows.outcome[k] == RowOutcome::Zero) continue;
          some.push_back(k);
          longest = std::max(longest, outer[k + 1] - outer[k]);
        }
        memory.resize(bound_memory(cloud.dimension(), tables.of_all(), longest));
        bound(tables.of_all(), rows, some.data(), static_cast<int>(some.size()), longest,
              errors.data(), memory.data());
      });
  return errors;
}

DenseVector certified_errors(Derivative derivative, const Cloud& cloud, const Operator& op,
                             const VectorView& wavelengths, int threads) {
  checked_threads(threads);
  check(gradpsi::target(derivative), cloud, op, wavelengths);
  return bounded_errors(derivative, cloud, op, wavelengths, 0, threads);
}

}  // namespace gradpsi
