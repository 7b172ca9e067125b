// Rows that are chosen to a tolerance.

#include <algorithm>
#include <string>
#include <vector>

#include "base/text.hpp"
#include "python/arrays.hpp"

namespace gradpsi::python {
namespace {

/// By its name.
Derivative derivative(const std::string& wanted) {
  std::vector<std::string> valid;
  for (const Scheme& scheme : schemes()) {
    const std::string known(name(scheme.derivative));
    if (known == wanted) return scheme.derivative;
    if (std::ranges::find(valid, known) == valid.end()) valid.push_back(known);
  }
  throw_unknown("derivative", wanted, valid);
}

/// One length for all points, or one a point.
DenseVector lengths(const ArrayLike& given) {
  const auto one = number(given, "wavelength");
  return one ? DenseVector::Constant(1, *one) : vector(given, "wavelength");
}

Operator chosen(const std::string& wanted, const Cloud& cloud, double tolerance,
                const ArrayLike& wavelength, const std::string& kernel_name,
                const std::string& on_miss, bool stable, const ArrayLike& fixed, int threads) {
  ToleranceOptions options{.kernel = kernel(kernel_name),
                           .on_miss = choice<OnDegenerate>("on_miss", on_miss,
                                                           {{"fail", OnDegenerate::Fail},
                                                            {"lower", OnDegenerate::Lower},
                                                            {"zero", OnDegenerate::Zero}}),
                           .stable = stable,
                           .threads = threads};
  if (!fixed.is_none()) options.fixed = points(fixed, "fixed", cloud.size());
  const Accuracy accuracy{tolerance, lengths(wavelength)};
  const Derivative of = derivative(wanted);
  return without_gil([&] { return assemble_to(accuracy, of, cloud, options); });
}

}  // namespace

void bind_tolerance(py::module_& m) {
  m.def(
      "assemble_to", &chosen, py::arg("derivative"), py::arg("cloud"), py::kw_only(),
      py::arg("tolerance"), py::arg("wavelength"), py::arg("kernel") = kernels().front().name,
      py::arg("on_miss") = "fail", py::arg("stable") = false, py::arg("fixed") = py::none(),
      py::arg("threads") = 0,
      R"(A derivative each of whose rows is by the cheapest scheme and support that are good enough there.

derivative: "gradient", "laplacian" or "hessian". tolerance: the largest certified_errors() allowed,
relative to the derivative of the shortest wave that matters. wavelength: its length, one or n.
on_miss: rows that none is good enough for: "fail" (StencilError), "lower" to the best there is, "zero".
stable: of a Laplacian, whether solutions of du/dt = A u must not grow, as far as a forecast can tell;
fixed: points (indices or a mask) whose values do not evolve: their rows may miss the tolerance.
rows.schemes, rows.supports and rows.errors of what is returned say which rows these are.
threads: 0: as many as OpenMP offers; the result does not depend on it.
Raises InvalidInput if a number is out of range or sizes disagree, StencilError naming the tolerance that
all rows meet, SolverError if solutions grow all the same.)");
  m.def(
      "certified_errors",
      [](const std::string& wanted, const Cloud& cloud, const Operator& op,
         const ArrayLike& wavelength, int threads) {
        const DenseVector L = lengths(wavelength);
        const Derivative of = derivative(wanted);
        return without_gil([&] { return certified_errors(of, cloud, op, L, threads); });
      },
      py::arg("derivative"), py::arg("cloud"), py::arg("op"), py::arg("wavelength"), py::kw_only(),
      py::arg("threads") = 0,
      R"(What each row makes of waves of that length and longer, in any direction, at most (one a row):
the magnitude of its error over (2 pi / wavelength)^order, proved by Taylor's series. inf in zero rows.

op: rows of that derivative on these points. wavelength: a length > 0, one or n.
Raises InvalidInput if sizes disagree or a number is out of range.)");
}

}  // namespace gradpsi::python
