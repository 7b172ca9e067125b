// Values and derivatives between the points.

#include "python/arrays.hpp"

namespace gradpsi::python {
namespace {

py::object interpolate_one_or_more(const py::object& what, const Cloud& cloud,
                                   const ArrayLike& probes, const py::object& supports,
                                   const std::string& of_kernel, int threads) {
  const Positions x = positions(probes, "probes");
  DenseVector h;
  if (!supports.is_none()) {
    const ArrayLike given(supports);
    const auto one = number(given, "supports");
    h = one ? DenseVector::Constant(1, *one) : vector(given, "supports");
    if (h.size() == 0) throw InvalidInput("supports is empty");
  }
  const InterpolationOptions options{.kernel = kernel(of_kernel), .threads = threads};
  return one_or_more(what, [&](const auto& wanted) {
    return without_gil([&] { return interpolate(wanted, cloud, x, h, options); });
  });
}

}  // namespace

void bind_interpolate(py::module_& m) {
  m.def("interpolate", &interpolate_one_or_more, py::arg("scheme"), py::arg("cloud"),
        py::arg("probes"), py::arg("supports") = py::none(), py::kw_only(),
        py::arg("kernel") = "wendland-c2", py::arg("threads") = 0,
        R"(Values or derivatives at probes (m x d), which need not be points of the cloud.

The weights are those of a fit around each probe, exact on polynomials of the scheme's degree:
"value-mls-P" (P = 0: Shepard's), "gradient-mls-P", "laplacian-mls-P", "hessian-mls-P", or a sequence
of those, then a list. Matrices are m x n: op.matrix @ u are the values.
supports: lengths as find_neighbours() takes them; a probe has that of the point nearest to it. None: as
far as each probe needs, a tenth more than the distance of its (3 (m + 1))-th nearest point, m the unknowns, at least d.
threads: 0: as many as OpenMP offers; the result does not depend on it.
Raises InvalidInput for probes outside the cloud, farther from all points than half the support (without
supports if that is also more than their nearest point is from its (3 (d + 1))-th nearest), naming them
with their distance, for another scheme, and if a size or a number is out of range; StencilError for the first probe whose
row cannot be computed.)");
  m.def(
      "conservative_transfer",
      [](const Operator& value, const ArrayLike& probe_volumes) {
        const DenseVector volumes = vector(probe_volumes, "probe_volumes");
        return csr(without_gil([&] { return conservative_transfer(value, volumes); }));
      },
      py::arg("value"), py::arg("probe_volumes"),
      R"(The scipy.sparse.csr_matrix, n x m, that brings densities from the probes to the points.

sum(cloud volumes * (R @ u)) = sum(probe_volumes * u) for any u: R is the adjoint of the values at the
probes. value: interpolate("value-mls-1", cloud, probes).
Raises InvalidInput if sizes disagree, a volume is not > 0 and finite, or value is no such operator.)");
}

}  // namespace gradpsi::python
