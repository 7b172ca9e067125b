// What the entries of a matrix tell.

#include <string>

#include "python/arrays.hpp"

namespace gradpsi::python {
namespace {

template <DenseVector RowDiagnosis::*member>
py::array per_row(const py::object& self) {
  return view(self.cast<const RowDiagnosis&>().*member, self);
}

/// Columns are contiguous.
template <DenseMatrix RowDiagnosis::*member>
py::object per_row_and_degree(const py::object& self) {
  const DenseMatrix& x = self.cast<const RowDiagnosis&>().*member;
  return view(x.data(), x.size(), self).attr("reshape")(x.cols(), x.rows()).attr("T");
}

void bind_rows(py::module_& m) {
  m.def(
      "warnings",
      [](const Cloud& cloud, const Neighbours& near, int threads) {
        return without_gil([&] { return warnings(cloud, near, threads); });
      },
      py::arg("cloud"), py::arg("near"), py::kw_only(), py::arg("threads") = 0,
      R"(What about the points deserves a warning: sentences, none if all is well.

Pairs much closer than is usual; coordinates so far from the origin that they have lost digits.)");
  py::class_<RowDiagnosis>(
      m, "RowDiagnosis",
      R"(What an operator's entries tell about each of its n rows; arrays are read-only.

With q = 1 for gradients, 2 for Laplacians, P the scheme's degree, K = max(P, q) + 2.)")
      .def_property_readonly("amplification", &per_row<&RowDiagnosis::amplification>,
                             "n: dx_i^q sum_j |a_ij|, dx_i = volume_i^(1/d); 2 to 10 is healthy, "
                             "1e2 suspect, 1e5 broken")
      .def_property_readonly("negative_share", &per_row<&RowDiagnosis::negative_share>,
                             "n: negative ones among the neighbours' weights, by number, 0 to 1")
      .def_property_readonly("residuals", &per_row_and_degree<&RowDiagnosis::residuals>,
                             "n x (K + 1): how far the moments of degree k are from what the "
                             "derivative asks for, length^(k - q)")
      .def_property_readonly("remainders", &per_row_and_degree<&RowDiagnosis::remainders>,
                             "n x (K + 2): sum_j |a_ij| r_ij^k / k!, length^(k - q)");
}

void bind_errors_of_rows(py::module_& m) {
  m.def(
      "diagnose",
      [](const SchemeLike& what, const Cloud& cloud, const Operator& op, int threads) {
        const Scheme one = scheme(what);
        return without_gil([&] { return diagnose(one, cloud, op, threads); });
      },
      py::arg("scheme"), py::arg("cloud"), py::arg("op"), py::arg("threads") = 0,
      R"(What the entries of `op`, all n rows of `scheme` on `cloud`, tell about each row: a
RowDiagnosis.

threads: 0: as many as OpenMP offers; the result does not depend on it.
Raises InvalidInput if sizes disagree or threads is out of range.)");
  m.def(
      "error_bound",
      [](const RowDiagnosis& rows, const ArrayLike& derivatives) {
        const auto bounds = positions(derivatives, "derivatives");
        const DenseMatrix M = bounds.cols() == 1 ? bounds.transpose() : bounds;
        return without_gil([&] { return error_bound(rows, M); });
      },
      py::arg("rows"), py::arg("derivatives"),
      R"(A bound of the error at each point (n), by Taylor's theorem.

derivatives: n x (K + 2), or K + 2 for all points: bounds of |D^k u|, k = 0 .. K + 1, the
  Frobenius norm of all derivatives of order k, on the lines to the neighbours; |wave vector|^k
  for a wave.
Raises InvalidInput if it has another shape.)");
}

void bind_summary(py::module_& m) {
  py::class_<MatrixSummary>(m, "MatrixSummary", "What a Laplacian's entries tell about the matrix.")
      .def_readonly("symmetric", &MatrixSummary::symmetric, "omega_i a_ij = omega_j a_ji")
      .def_readonly("dominant", &MatrixSummary::dominant, "|a_ii| >= sum_j |a_ij| in every row")
      .def_readonly("m_matrix", &MatrixSummary::m_matrix,
                    "Minus the matrix is one: no negative weight, and dominant")
      .def_readonly("bandwidth", &MatrixSummary::bandwidth, "Largest |i - j| of an entry")
      .def_readonly("leftmost", &MatrixSummary::leftmost,
                    "By Gershgorin no eigenvalue has a real part below this (1/length^2)")
      .def_readonly("rightmost", &MatrixSummary::rightmost,
                    "By Gershgorin no eigenvalue has a real part above this (1/length^2)")
      .def_property_readonly(
          "solver", [](const MatrixSummary& s) { return s.symmetric ? "cholesky" : "lu"; },
          "For implicit steps: \"cholesky\" where the matrix is symmetric, else \"lu\"");
  m.def(
      "summarise",
      [](const SparseLike& laplacian, const ArrayLike& volumes) {
        const SparseMatrix A = sparse(laplacian, "laplacian");
        const DenseVector omega = vector(volumes, "volumes");
        return without_gil([&] { return summarise(A, omega); });
      },
      py::arg("laplacian"), py::arg("volumes"),
      "What a Laplacian's entries tell about the matrix: a MatrixSummary. volumes: n, those of the "
      "operator.");
}

void bind_forecast(py::module_& m) {
  py::class_<Forecast>(m, "Forecast",
                       "Whether solutions of du/dt = nu A u grow, told from a few rows.")
      .def_readonly("grows", &Forecast::grows, "Whether they do")
      .def_readonly("certain", &Forecast::certain,
                    "Proved, by Gershgorin's theorem or by Cauchy's interlacing")
      .def_readonly("point", &Forecast::point, "Where growth is fastest; -1: nowhere")
      .def_readonly("rate", &Forecast::rate, "There, 1/length^2; <= 0 without growth");
  m.def(
      "forecast",
      [](const Cloud& cloud, const SparseLike& laplacian, const ArrayLike& where,
         const ArrayLike& volumes) {
        const SparseMatrix A = sparse(laplacian, "laplacian");
        const std::vector<int> evolving = points(where, "points", cloud.size());
        const DenseVector omega = vector(volumes, "volumes");
        return without_gil([&] { return forecast(cloud, A, evolving, omega); });
      },
      py::arg("cloud"), py::arg("laplacian"), py::arg("points"), py::arg("volumes"),
      R"(Whether solutions of du/dt = nu A u grow, told from the rows that are worst: a
Forecast.

laplacian: n x n, of the cloud's points. points: those that evolve, ascending indices or a mask;
  the others are fixed. volumes: n, those of the operator.)");
}

void bind_spectrum(py::module_& m) {
  py::class_<Spectrum>(m, "Spectrum", "Eigenvalues of a matrix, 1/length^2 for a Laplacian.")
      .def_property_readonly(
          "values",
          [](const py::object& self) { return view(self.cast<const Spectrum&>().values, self); },
          "All in no order, or the rightmost and the leftmost; complex, read-only")
      .def_readonly("complete", &Spectrum::complete, "Whether these are all")
      .def_readonly("zero", &Spectrum::zero, "What counts as zero: 1e-3 of the median |a_ii|")
      .def_property_readonly("rightmost", &Spectrum::rightmost,
                             "Largest real part; 0 without eigenvalues")
      .def_property_readonly("leftmost", &Spectrum::leftmost, "Smallest real part")
      .def_property_readonly("widest", &Spectrum::widest, "Largest imaginary part")
      .def_property_readonly("grows", &Spectrum::grows, "rightmost > zero");
  m.def(
      "spectrum",
      [](const SparseLike& matrix, const ArrayLike& volumes, int complete_below, int threads) {
        const SparseMatrix A = sparse(matrix, "matrix");
        const DenseVector omega = optional_vector(volumes, "volumes", A.rows());
        return without_gil([&] { return spectrum(A, omega, complete_below, threads); });
      },
      py::arg("matrix"), py::arg("volumes") = py::none(), py::kw_only(),
      py::arg("complete_below") = 2000, py::arg("threads") = 0,
      R"(Eigenvalues of a scipy.sparse matrix: a Spectrum.

Up to complete_below rows (at least 100) all of them, O(n^3); else the rightmost and the
leftmost, to 1e-7 of their distance.
volumes: n: a matrix that is symmetric after scaling by them is treated as such, faster and more
  accurately.
threads: 0: as many as OpenMP offers; the result does not depend on it.
Of points that are not fixed: spectrum(A[free][:, free], volumes[free]).
Raises SolverError if the iteration does not converge.)");
}

void bind_steps(py::module_& m) {
  m.def(
      "largest_stable_step",
      [](const Spectrum& spectrum, const std::string& stepper) {
        return largest_stable_step(
            spectrum,
            choice<Stepper>("stepper", stepper,
                            {{"euler", Stepper::Euler}, {"runge-kutta-4", Stepper::RungeKutta4}}));
      },
      py::arg("spectrum"), py::arg("stepper"),
      R"(Largest dt nu (length^2) of explicit steps of du/dt = nu A u that lets no eigenvector grow.

stepper: "euler" or "runge-kutta-4". 0: one grows at any step; inf: all eigenvalues are zero.)");
  m.def(
      "singular_steps",
      [](const Spectrum& spectrum) {
        const std::vector<double> steps = singular_steps(spectrum);
        return py::array_t<double>(static_cast<py::ssize_t>(steps.size()), steps.data());
      },
      py::arg("spectrum"), "dt nu (length^2, ascending) at which I - dt nu A is singular.");
}

}  // namespace

void bind_diagnosis(py::module_& m) {
  bind_rows(m);
  bind_errors_of_rows(m);
  bind_summary(m);
  bind_forecast(m);
  bind_spectrum(m);
  bind_steps(m);
}

}  // namespace gradpsi::python
