#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <vector>

#include "base/parallel.hpp"
#include "base/text.hpp"
#include "cloud/points.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/tolerance.hpp"
#include "schemes/check.hpp"
#include "schemes/targets.hpp"
#include "tolerance/candidates.hpp"
#include "tolerance/certificate.hpp"
#include "tolerance/row_choice.hpp"
#include "tolerance/row_store.hpp"
#include "tolerance/stable.hpp"

namespace gradpsi {
namespace {

void check(const Accuracy& wanted, Derivative derivative, const Cloud& cloud,
           const ToleranceOptions& options) {
  if (!(wanted.tolerance > 0 && std::isfinite(wanted.tolerance)))
    throw InvalidInput("the tolerance must be > 0 and finite, not " + shortest(wanted.tolerance));
  if (row_candidates(derivative, cloud.dimension(), false).empty())
    throw InvalidInput("rows of a " + std::string(name(derivative)) +
                       " are not chosen to a tolerance");
  if (options.on_miss == OnDegenerate::Widen)
    throw InvalidInput("rows that miss a tolerance fail, are lowered or zero, not widened");
  if (options.stable && (order(derivative) != 2 || components(derivative, 2).size() != 1))
    throw InvalidInput("solutions of du/dt = A u are about Laplacians, not a " +
                       std::string(name(derivative)));
  for (std::size_t k = 0; k < options.fixed.size(); ++k)
    if (options.fixed[k] < 0 || options.fixed[k] >= cloud.size() ||
        (k > 0 && options.fixed[k] <= options.fixed[k - 1]))
      throw InvalidInput("fixed points must ascend from 0 to " + std::to_string(cloud.size() - 1) +
                         ", not be " + std::to_string(options.fixed[k]));
  checked_threads(options.threads);
  check_kernel(options.kernel, cloud.dimension());
  check_wavelengths(order(derivative), cloud.size(), wanted.wavelengths);
}

[[noreturn]] void throw_missed(const Accuracy& wanted, const Cloud& cloud, RowStore& rows,
                               const std::vector<int>& missed) {
  const int first = missed.front();
  const double worst = rows.report().errors(missed).maxCoeff();
  const std::string of_all = std::isfinite(worst)
                                 ? "all rows meet a tolerance of " + rounded(1.005 * worst)
                                 : "some have no answer at all";
  throw StencilError(
      "no row is good to " + shortest(wanted.tolerance) + " at point " +
          std::to_string(cloud.number(first)) + ": the best one has an error of " +
          (std::isfinite(rows.error(first)) ? rounded(rows.error(first)) : "infinity") + " (at " +
          coordinates(cloud.positions(), first) + "); " + std::to_string(missed.size()) + " of " +
          std::to_string(cloud.size()) +
          (missed.size() == 1 ? " rows misses it; " : " rows miss it; ") + of_all,
      first, rows.report().neighbours[first], rows.report().reciprocal_condition[first]);
}

}  // namespace

Operator assemble_to(const Accuracy& wanted, Derivative derivative, const Cloud& cloud,
                     const ToleranceOptions& options) {
  check(wanted, derivative, cloud, options);
  if (cloud.size() < 2) {
    RowStore none(cloud.size(), target(derivative).outputs(cloud.dimension()));
    if (cloud.size() > 0 && options.on_miss == OnDegenerate::Fail)
      throw_missed(wanted, cloud, none, {0});
    return none.operator_of(DenseVector::Ones(cloud.size()));
  }
  RowChoice choice(wanted, derivative, cloud, options);
  choice.choose();
  RowStore& rows = choice.rows();
  std::vector<int> missed;
  std::ranges::set_difference(choice.left(), options.fixed, std::back_inserter(missed));
  if (!missed.empty() && options.on_miss == OnDegenerate::Fail)
    throw_missed(wanted, cloud, rows, missed);
  if (options.stable) make_stable(choice, options.fixed);
  for (const int i : missed)
    if (options.on_miss == OnDegenerate::Zero)
      rows.drop(i);
    else if (std::isfinite(rows.error(i)))
      rows.report().outcome[i] = RowOutcome::Lowered;
  return rows.operator_of(choice.volumes());
}

}  // namespace gradpsi
