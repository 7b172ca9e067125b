// Operators on fields of vectors.

#include <string>

#include "python/arrays.hpp"

namespace gradpsi::python {
namespace {

VectorOperator vector_operator(const std::string& wanted) {
  std::vector<std::string> valid;
  for (const VectorOperator what : vector_operators()) {
    if (name(what) == wanted) return what;
    valid.emplace_back(name(what));
  }
  throw_unknown("vector operator", wanted, valid);
}

py::array vector_derivative(const std::string& what, const Operator& op, const ArrayLike& v,
                            int threads) {
  const VectorOperator wanted = vector_operator(what);
  Fields fields(v, "v");
  DenseMatrix result;
  without_gil([&] { multiply(wanted, op.axes, fields.values, result, threads); });
  fields.values = std::move(result);
  fields.single = fields.values.cols() == 1;
  return fields.array();
}

py::list companion(const Operator& gradient, int threads) {
  py::list matrices;
  for (SparseMatrix& A : without_gil([&] { return conservative_companion(gradient, threads); }))
    matrices.append(csr(std::move(A)));
  return matrices;
}

void bind_products(py::module_& m) {
  m.def("vector_derivative", &vector_derivative, py::arg("what"), py::arg("op"), py::arg("v"),
        py::arg("threads") = 0,
        R"(A derivative of vectors v (n x d, a component a column), from one pass over the matrices.

what: from a gradient "divergence", "curl" (2D: dv_y/dx - dv_x/dy), "velocity-gradient" (dv_a/dx_b;
  xx, xy, yx, yy), "strain" ((dv_a/dx_b + dv_b/dx_a)/2; xx, xy, yy), and "gradient" of n numbers;
  from a Hessian "grad-div".
op: the gradient or the Hessian; rows of some points do.
Returns n numbers, or n x k with the components in that order. Bitwise the same with any number of
threads (0: as many as OpenMP offers).
Raises InvalidInput if there is no such operator, or matrices and components are not those it takes.)");
  m.def(
      "block_matrix",
      [](const std::string& what, const Operator& op, int threads) {
        const VectorOperator wanted = vector_operator(what);
        return csr(without_gil([&] { return block_matrix(wanted, op.axes, threads); }));
      },
      py::arg("what"), py::arg("op"), py::arg("threads") = 0,
      R"(The operator of vector_derivative() as one scipy.sparse.csr_matrix of blocks.

Vectors are d n numbers, all of the first component first: v.T.ravel() of v (n x d). So is the result.
Two passes are products: block_matrix("gradient", G) @ block_matrix("divergence", G) is grad div.
Raises InvalidInput as vector_derivative().)");
}

void bind_forces(py::module_& m) {
  m.def(
      "viscous_force",
      [](const Operator& hessian, const Operator& gradient, const ArrayLike& mu, int threads) {
        const DenseVector viscosity = vector(mu, "mu");
        return csr(
            without_gil([&] { return viscous_force(hessian, gradient, viscosity, threads); }));
      },
      py::arg("hessian"), py::arg("gradient"), py::arg("mu"), py::arg("threads") = 0,
      R"(div(mu (grad v + grad v^T)) as a scipy.sparse.csr_matrix of d x d blocks, ordered as those of
block_matrix().

hessian, gradient: of the same points and neighbours. mu: n numbers >= 0.
Raises InvalidInput if sizes or patterns disagree or a mu is out of range (names the point).)");
  m.def("conservative_companion", &companion, py::arg("gradient"), py::arg("threads") = 0,
        R"(The gradient that conserves momentum: G+ = -Omega^-1 G^T Omega, d csr_matrices.

With volumes as weights it is the negative adjoint of the divergence by `gradient`, and the sum of
volumes * (G+ @ p) is 0 for any p: a force and no approximation of grad p.
Raises InvalidInput if `gradient` lacks rows.)");
}

}  // namespace

void bind_vector_calculus(py::module_& m) {
  bind_products(m);
  bind_forces(m);
}

}  // namespace gradpsi::python
