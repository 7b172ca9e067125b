#include "operators/assemble.hpp"

#include <algorithm>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include "base/copy_pattern.hpp"
#include "base/parallel.hpp"
#include "base/resize.hpp"
#include "base/text.hpp"
#include "gradpsi/error.hpp"
#include "operators/degenerate.hpp"
#include "operators/fill.hpp"
#include "operators/passes.hpp"
#include "operators/surface.hpp"
#include "operators/widen.hpp"
#include "schemes/check.hpp"
#include "schemes/recipe.hpp"
#include "schemes/targets.hpp"
#include "search/check.hpp"

namespace gradpsi {
namespace {

/// Refuses supports so large that weights, 1/h or 1/h^2, would vanish or lose digits.
void check_unit(const Scheme& scheme, const DenseVector& supports) {
  if (supports.size() == 0) return;
  const double h = supports.maxCoeff();
  const bool first = order(scheme.derivative) == 1;
  if (1 / h / (first ? 1 : h) < std::numeric_limits<double>::min())
    throw InvalidInput("with support " + shortest(h) + " the weights of a " +
                       std::string(name(scheme.derivative)) + ", about 1/support" +
                       (first ? "" : "^2") + ", are below the range of a double");
}

void check(const Scheme& scheme, const Cloud& cloud, const Neighbours& near,
           const AssemblyOptions& options) {
  static_cast<void>(recipe(scheme));
  if (on_surface(cloud, options) && order(scheme.derivative) > 1 &&
      target(scheme.derivative).outputs(2) > 1)
    throw InvalidInput(name(scheme) + " is not for surfaces: gradients and Laplacians are");
  check_unit(scheme, near.supports);
}

void check(std::span<const Scheme> schemes, const Cloud& cloud, const Neighbours& near,
           const AssemblyOptions& options) {
  checked_threads(options.threads);
  check_match(cloud, near, options.threads);
  for (const Scheme& scheme : schemes) check(scheme, cloud, near, options);
  check_kernel(options.kernel, row_dimension(cloud, options));
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

DenseVector measures(const Cloud& cloud, const Neighbours& near, const AssemblyOptions& options) {
  return (on_surface(cloud, options) ? number_density_areas : number_density_volumes)(
      cloud, near, options.kernel, options.threads);
}

/// Gives the operator's matrices their pattern, copied from another's if there is one.
void prepare(const Equations& equations, const Cloud& cloud, const Neighbours& near,
             const ChosenRows& rows, const SparseMatrix* pattern, const AssemblyOptions& options,
             Operator& op) {
  const bool surface = on_surface(cloud, options);
  op.axes.resize(surface ? surface_outputs(equations) : equations.outputs);
  if (surface) op.normals.resize(rows.count, 3);
  for (SparseMatrix& matrix : op.axes) {
    pattern ? copy_pattern(matrix, *pattern, options.threads)
            : set_pattern(matrix, near, rows, options.threads);
    pattern = pattern ? pattern : &matrix;
  }
  op.rows = empty_report(rows.count);
  if (rows.chosen) op.points = *rows.chosen;
}

/// What remains to be done once the rows have been computed: the policy's part, and what positive stencils
/// do not need is removed.
void finish(const Scheme& scheme, const Cloud& cloud, const ChosenRows& rows,
            const AssemblyOptions& options, Operator& op) {
  if (options.on_degenerate == OnDegenerate::Fail) throw_if_degenerate(scheme, cloud, rows, op);
  if (options.on_degenerate == OnDegenerate::Widen) widen(scheme, cloud, rows, options, op);
  if (recipe(scheme).how == How::Programme)
    for (SparseMatrix& matrix : op.axes)
      matrix.prune([&](int k, int j, double a) { return a != 0 || j == rows.point(k); });
}

/// reassemble() for any number of operators.
void fill_again(std::span<const Scheme> schemes, const Cloud& cloud, const Neighbours& near,
                std::span<Operator> operators, const AssemblyOptions& options) {
  if (schemes.size() != operators.size())
    throw InvalidInput(std::to_string(schemes.size()) + " schemes are for as many operators, not " +
                       std::to_string(operators.size()));
  if (schemes.empty()) return;
  check(schemes, cloud, near, options);
  const ChosenRows rows = chosen_rows(options, cloud);
  for (std::size_t r = 0; r < schemes.size(); ++r)
    check_pattern(schemes[r], cloud, near, rows, operators[r], options);
  DenseVector computed;
  if (!cloud.has_volumes()) computed = measures(cloud, near, options);
  const DenseVector& volumes = cloud.has_volumes() ? cloud.volumes() : computed;
  std::vector<Request> requests;
  for (std::size_t r = 0; r < schemes.size(); ++r) {
    Operator& op = operators[r];
    resize(op.volumes, cloud.size());
    op.volumes = volumes;  // copied, not moved: others may have views of the numbers that are there
    if (on_surface(cloud, options)) resize(op.normals, rows.count, 3);
    requests.push_back(
        {&op, ladder(schemes[r], row_dimension(cloud, options), options.on_degenerate)});
  }
  fill(&cpu(), requests, cloud, near, volumes, rows, options);
  for (std::size_t r = 0; r < schemes.size(); ++r)
    finish(schemes[r], cloud, rows, options, operators[r]);
}

}  // namespace

Operator assemble(const Scheme& scheme, const Cloud& cloud, const Neighbours& near,
                  const AssemblyOptions& options) {
  return std::move(assemble(std::vector<Scheme>{scheme}, cloud, near, options).front());
}

std::vector<Operator> assemble(const std::vector<Scheme>& schemes, const Cloud& cloud,
                               const Neighbours& near, const AssemblyOptions& options) {
  return assemble_with(&cpu(), schemes, cloud, near, options);
}

std::vector<Operator> assemble_with(const Cpu* cpu, const std::vector<Scheme>& schemes,
                                    const Cloud& cloud, const Neighbours& near,
                                    const AssemblyOptions& options, const DenseVector& volumes) {
  if (schemes.empty()) return {};
  check(schemes, cloud, near, options);
  const ChosenRows rows = chosen_rows(options, cloud);
  std::vector<Operator> operators(schemes.size());
  std::vector<Request> requests;
  for (std::size_t r = 0; r < schemes.size(); ++r) {
    if (recipe(schemes[r]).how == How::Passes) {
      operators[r] = two_passes(schemes[r], cloud, near, options);
      continue;
    }
    const Operator* const first = requests.empty() ? nullptr : requests.front().op;
    requests.push_back(
        {&operators[r], ladder(schemes[r], row_dimension(cloud, options), options.on_degenerate)});
    prepare(requests.back().steps.front(), cloud, near, rows, first ? &first->axes[0] : nullptr,
            options, operators[r]);
    operators[r].volumes = first                 ? first->volumes
                           : volumes.size() > 0  ? volumes
                           : cloud.has_volumes() ? cloud.volumes()
                                                 : measures(cloud, near, options);
  }
  if (requests.empty()) return operators;
  fill(cpu, requests, cloud, near, requests.front().op->volumes, rows, options);
  for (std::size_t r = 0; r < schemes.size(); ++r)
    if (recipe(schemes[r]).how != How::Passes)
      finish(schemes[r], cloud, rows, options, operators[r]);
  return operators;
}

void reassemble(const Scheme& scheme, const Cloud& cloud, const Neighbours& near, Operator& op,
                const AssemblyOptions& options) {
  fill_again({&scheme, 1}, cloud, near, {&op, 1}, options);
}

void reassemble(const std::vector<Scheme>& schemes, const Cloud& cloud, const Neighbours& near,
                std::vector<Operator>& operators, const AssemblyOptions& options) {
  fill_again(schemes, cloud, near, operators, options);
}

}  // namespace gradpsi
