// Kernels and schemes: two tables.

#include <string>

#include "python/arrays.hpp"

namespace gradpsi::python {
namespace {

py::list names_of_kernels() {
  py::list names;
  for (const Kernel& kernel : kernels()) names.append(kernel.name);
  return names;
}

py::tuple kernel_values(const std::string& name, int dimension, double support,
                        const ArrayLike& r) {
  const Kernel& of_that_name = kernel(name);
  const DenseVector distances = vector(r, "r");
  DenseVector w(distances.size()), dw_over_r(distances.size()), d2w(distances.size());
  for (Eigen::Index k = 0; k < distances.size(); ++k) {
    const KernelValue value = evaluate(of_that_name, dimension, support, distances[k]);
    w[k] = value.w;
    dw_over_r[k] = value.dw_over_r;
    d2w[k] = value.d2w;
  }
  return py::make_tuple(w, dw_over_r, d2w);
}

void bind_kernels(py::module_& m) {
  m.def("kernels", &names_of_kernels,
        "The names of all kernels; the first, the quintic Wendland kernel, is the default.\n\n"
        "Kernels of one's own are left to C++: a Python function called for each pair of\n"
        "neighbours would be slow and would hold the GIL.");
  m.def("kernel_values", &kernel_values, py::arg("kernel"), py::arg("dimension"),
        py::arg("support"), py::arg("r"), R"(W, W'/r and W'' of a kernel, three arrays as long
as r.

dimension: 1, 2 or 3; support: h > 0, the radius beyond which W is zero; r: n distances >= 0.
W is in 1/length^d, the other two in 1/length^(d+2).
Raises InvalidInput if there is no such kernel, listing those there are, or a number is out of
range.)");
}

/// What a row of the table says.
void bind_properties(py::class_<Scheme>& type) {
  type.def_property_readonly(
          "name", [](const Scheme& s) { return name(s); },
          "derivative-weight-consistency, such as \"laplacian-mixed-soc\"")
      .def_property_readonly(
          "derivative", [](const Scheme& s) { return name(s.derivative); },
          "\"gradient\", \"laplacian\" or \"hessian\"")
      .def_property_readonly(
          "weight", [](const Scheme& s) { return name(s.weight); },
          "\"direct\", \"diffuse\", \"diffuse-ns\", \"mixed\"; \"kernel\" and \"distance\" are not "
          "part of names")
      .def_property_readonly(
          "consistency", [](const Scheme& s) { return consistency_name(s); },
          "\"zoc\", \"foc\", \"soc\", \"soc-ls\", \"positive\", \"ls-1\" to \"ls-6\"")
      .def_property_readonly(
          "degree", [](const Scheme& s) { return degree(s); },
          "The degree of the polynomials that every row differentiates exactly, 0 to 6")
      .def_property_readonly(
          "formula", [](const Scheme& s) { return formula(s); },
          "G_ij or psi_ij in plain text, with phi(r) written out")
      .def_property_readonly(
          "conditions", [](const Scheme& s) { return conditions(s); },
          "What every row's weights meet to rounding, with the paper's equation numbers")
      .def_property_readonly(
          "symmetry", [](const Scheme& s) { return name(symmetry(s)); },
          "\"none\", \"symmetric\" or \"antisymmetric\", after scaling by volume, with one support "
          "for all")
      .def_property_readonly(
          "support_ratio", [](const Scheme& s) { return support_ratio(s); },
          "The support that the scheme brings along, as a multiple of the spacing; None: it is "
          "your choice");
}

void bind_schemes(py::module_& m) {
  py::class_<Scheme> type(m, "Scheme",
                          R"(A derivative as weighted sums over the neighbours: a row of schemes().

    (grad u)_i = sum_j G_ij (u_j - u_i),     (lap u)_i = sum_j psi_ij (u_j - u_i)

Wherever a scheme is expected, its name will do.)");
  type.def(py::init([](const std::string& name) { return Scheme(name); }), py::arg("name"),
           "The scheme of that name; raises InvalidInput listing the valid names, nearest spelling "
           "first.");
  bind_properties(type);
  type.def(
          "unknowns", [](const Scheme& s, int dimension) { return unknowns(s, dimension); },
          py::arg("dimension"),
          "The number of conditions on a row's weights in 1, 2 or 3 dimensions")
      .def(
          "__eq__",
          [](const Scheme& s, const py::object& other) {
            return py::isinstance<Scheme>(other) && s == other.cast<Scheme>();
          },
          py::arg("other"))
      .def("__hash__", [](const Scheme& s) { return py::hash(py::str(name(s))); })
      .def("__repr__", [](const Scheme& s) { return "gradpsi.Scheme('" + name(s) + "')"; });
  m.def(
      "schemes", [] { return std::vector<Scheme>(schemes().begin(), schemes().end()); },
      "All schemes: the nine gradients and eight Laplacians of the paper's Tables I and II, then\n"
      "Laplacians and gradients by least squares and the positive Laplacian.");
}

}  // namespace

void bind_scheme(py::module_& m) {
  bind_kernels(m);
  bind_schemes(m);
}

}  // namespace gradpsi::python
