// Derivatives as matrices.

#include <algorithm>
#include <cctype>
#include <string>

#include "python/arrays.hpp"

namespace gradpsi::python {
namespace {

AssemblyOptions assembly_options(const Cloud& cloud, const std::string& kernel_name,
                                 const std::string& on_degenerate, const ArrayLike& rows,
                                 bool on_surface, int threads) {
  AssemblyOptions options{.kernel = kernel(kernel_name),
                          .on_degenerate = choice<OnDegenerate>("on_degenerate", on_degenerate,
                                                                {{"fail", OnDegenerate::Fail},
                                                                 {"lower", OnDegenerate::Lower},
                                                                 {"widen", OnDegenerate::Widen},
                                                                 {"zero", OnDegenerate::Zero}}),
                          .threads = threads,
                          .on_surface = on_surface};
  if (!rows.is_none()) options.rows = points(rows, "rows", cloud.size());
  return options;
}

py::object assemble_one_or_more(const py::object& what, const Cloud& cloud, const Neighbours& near,
                                const std::string& kernel, const std::string& on_degenerate,
                                const ArrayLike& rows, bool on_surface, int threads) {
  const AssemblyOptions options =
      assembly_options(cloud, kernel, on_degenerate, rows, on_surface, threads);
  return one_or_more(what, [&](const auto& wanted) {
    return without_gil([&] { return assemble(wanted, cloud, near, options); });
  });
}

void assemble_again(const SchemeLike& what, const Cloud& cloud, const Neighbours& near,
                    Operator& op, const std::string& kernel, const std::string& on_degenerate,
                    const ArrayLike& rows, bool on_surface, int threads) {
  const AssemblyOptions options =
      assembly_options(cloud, kernel, on_degenerate, rows, on_surface, threads);
  const Scheme one = scheme(what);
  without_gil([&] { reassemble(one, cloud, near, op, options); });
}

py::list axes(const py::object& self) {
  py::list matrices;
  for (const SparseMatrix& axis : self.cast<const Operator&>().axes)
    matrices.append(csr(axis, self));
  return matrices;
}

std::string summary(const Operator& op) {
  const SparseMatrix& A = op.matrix();
  const std::string count = op.axes.size() == 1 ? "" : std::to_string(op.axes.size()) + " x ";
  return "<gradpsi.Operator: " + count + std::to_string(A.rows()) + " x " +
         std::to_string(A.cols()) + ", " + std::to_string(A.nonZeros()) + " entries>";
}

py::array product(const Operator& op, const ArrayLike& u, int threads) {
  Fields fields(u, "u");
  if (op.axes.size() == 1) {
    DenseMatrix result;
    without_gil([&] { multiply(op.matrix(), fields.values, result, threads); });
    fields.values = std::move(result);
    return fields.array();
  }
  if (!fields.single) throw InvalidInput("several matrices are multiplied by one field at a time");
  DenseMatrix result;
  const DenseVector field = fields.values.col(0);
  without_gil([&] { multiply(std::span(op.axes), field, result, threads); });
  return py::cast(std::move(result));
}

/// enum.IntEnum, so that members can be compared with arrays of numbers.
py::object row_outcomes() {
  py::dict members;
  for (const RowOutcome outcome :
       {RowOutcome::AsAsked, RowOutcome::Lowered, RowOutcome::Widened, RowOutcome::Zero}) {
    std::string its_name(name(outcome));
    std::ranges::transform(its_name, its_name.begin(),
                           [](unsigned char c) { return c == '-' ? '_' : std::toupper(c); });
    members[its_name.c_str()] = static_cast<int>(outcome);
  }
  py::object result = py::module_::import("enum").attr("IntEnum")("RowOutcome", members,
                                                                  py::arg("module") = "gradpsi");
  result.attr("__doc__") = "What was done with a row: an entry of RowReport.outcome.";
  return result;
}

void bind_outcome(py::class_<RowReport>& rows) {
  rows.def_property_readonly(
          "schemes", [](const RowReport& report) { return report.schemes; },
          "By assemble_to(): the Scheme of each row, None in a zero row; else an empty list")
      .def_property_readonly(
          "errors",
          [](const py::object& self) { return view(self.cast<const RowReport&>().errors, self); },
          "By assemble_to(): the certified_errors() of each row; else empty")
      .def_property_readonly("degenerate", &RowReport::degenerate,
                             "The number of rows whose outcome is not AS_ASKED");
}

void bind_rows(py::module_& m) {
  m.attr("RowOutcome") = row_outcomes();

  py::class_<RowReport> rows(
      m, "RowReport",
      R"(How each assembled row came about: entry k belongs to row k of the matrices.

All arrays are read-only and not copies: reassemble() changes what they show.)");
  rows.def_property_readonly(
          "neighbours",
          [](const py::object& self) {
            return view(self.cast<const RowReport&>().neighbours, self);
          },
          "In the support used, without the point itself")
      .def_property_readonly(
          "supports",
          [](const py::object& self) { return view(self.cast<const RowReport&>().supports, self); },
          "Used: that of the neighbours, or what it was widened to (lengths)")
      .def_property_readonly(
          "reciprocal_condition",
          [](const py::object& self) {
            return view(self.cast<const RowReport&>().reciprocal_condition, self);
          },
          "Of the row's moment system in units of h, 0 to 1, in the 1-norm; 0: too few neighbours; "
          "1 for zoc")
      .def_property_readonly(
          "outcome",
          [](const py::object& self) {
            const auto& outcome = self.cast<const RowReport&>().outcome;
            return view(reinterpret_cast<const std::uint8_t*>(outcome.data()),
                        static_cast<Eigen::Index>(outcome.size()), self);
          },
          "Numbers of RowOutcome: rows.outcome == gradpsi.RowOutcome.LOWERED")
      .def_property_readonly(
          "degree",
          [](const py::object& self) { return view(self.cast<const RowReport&>().degree, self); },
          "Of the polynomials that the row differentiates exactly; -1 in a zero row");
  bind_outcome(rows);
}

constexpr auto assemble_doc =
    R"(The derivative operator of a scheme, or of several from one pass over the points (a list
then).

Row i holds a_ij with (L u)_i = sum_j a_ij (u_j - u_i); the diagonal is minus the sum of the
others, so rows sum to zero (but for gradient-symmetric and values). Matrices are n x n, with the pattern of `near` plus the diagonal.
Gradient entries are in 1/length, Laplacian entries in 1/length^2. With one support, zoc
Laplacians are symmetric after scaling by volume and, but for direct, negative semi-definite;
corrected matrices are neither.

scheme: a Scheme, its name, or a sequence of those.
kernel: one of kernels().
on_degenerate: what happens to rows that cannot be solved: "fail" (StencilError), "lower" their
  consistency, "widen" their support up to three times, leave them "zero". Operator.rows tells.
rows: assemble these points' rows only, in this order (indices or a mask); None: all.
on_surface: the points, n x 3, lie on a surface, and derivatives are those within it: the gradient
  along it, the Laplace-Beltrami operator. Volumes are areas; Operator.normals tells its normals.
threads: 0: as many as OpenMP offers; the result does not depend on it.
Raises InvalidInput if there is no such scheme or kernel, sizes disagree or a number is out of
range; StencilError for the first degenerate row (policy "fail").)";

constexpr auto reassemble_doc =
    R"(Puts new values in the place of those of `op`, which assemble() made with the same
neighbours and rows.

For points that have moved within one neighbour list, or another scheme for the same derivative.
Matrices and arrays that were taken from `op` before show the new values.
Raises what assemble() raises; InvalidInput also if `op` has another pattern, or if the pattern
depends on the values (laplacian-positive, policy "widen"). After a StencilError `op` holds what
could be computed.)";

void bind_matrices(py::module_& m) {
  py::class_<Operator>(m, "Operator",
                       R"(A derivative as sparse matrices, and how its rows came about.

The matrices are scipy's, over memory that they share with this object and keep alive: nothing
is copied, and asking twice gives two matrices over the same memory. Their values (A.data) may
be changed, which is seen here as well; their pattern (A.indices, A.indptr) is read-only,
A.copy() is free of that.)")
      .def_property_readonly(
          "axes", &axes,
          "scipy.sparse.csr_matrix d/dx, d/dy, d/dz (d of them); of a Laplacian: one")
      .def_property_readonly(
          "matrix",
          [](const py::object& self) { return csr(self.cast<const Operator&>().matrix(), self); },
          "scipy.sparse.csr_matrix: the Laplacian, or d/dx")
      .def_property_readonly(
          "volumes",
          [](const py::object& self) { return view(self.cast<const Operator&>().volumes, self); },
          "Of all n points, length^d: the cloud's or by number density; read-only, not a copy")
      .def_readonly("rows", &Operator::rows, "A RowReport")
      .def_property_readonly(
          "normals", [](const Operator& op) { return op.normals; },
          "Rows x 3, on a surface: its normals, of length 1 and of either sign; else empty")
      .def("__repr__", &summary);
}

void bind_functions(py::module_& m) {
  m.def("assemble", &assemble_one_or_more, py::arg("scheme"), py::arg("cloud"), py::arg("near"),
        py::kw_only(), py::arg("kernel") = kernels().front().name,
        py::arg("on_degenerate") = "fail", py::arg("rows") = py::none(),
        py::arg("on_surface") = false, py::arg("threads") = 0, assemble_doc);
  m.def("reassemble", &assemble_again, py::arg("scheme"), py::arg("cloud"), py::arg("near"),
        py::arg("op"), py::kw_only(), py::arg("kernel") = kernels().front().name,
        py::arg("on_degenerate") = "fail", py::arg("rows") = py::none(),
        py::arg("on_surface") = false, py::arg("threads") = 0, reassemble_doc);
  m.def("multiply", &product, py::arg("op"), py::arg("u"), py::arg("threads") = 0,
        R"(The derivative of u (n) by threads and vector code: the same as op.matrix @ u,
faster.

A Laplacian takes n x k, too, for k fields at once; a gradient gives n x d (in 1D n), all its
axes together. Bitwise the same with any number of threads (0: as many as OpenMP offers).
Raises InvalidInput if sizes disagree.)");
  m.def(
      "with_conductivity",
      [](const Operator& laplacian, const ArrayLike& conductivity, const std::string& mean,
         const Operator* gradient) {
        const DenseVector kappa = vector(conductivity, "conductivity");
        if (gradient && mean != "arithmetic")
          throw InvalidInput("the product rule, with a gradient, takes no mean");
        if (gradient)
          return without_gil([&] { return with_conductivity(laplacian, *gradient, kappa); });
        const auto of_two = choice<Mean>(
            "mean", mean, {{"arithmetic", Mean::Arithmetic}, {"harmonic", Mean::Harmonic}});
        return without_gil([&] { return with_conductivity(laplacian, kappa, of_two); });
      },
      py::arg("laplacian"), py::arg("conductivity"), py::arg("mean") = "arithmetic", py::kw_only(),
      py::arg("gradient") = py::none(),
      R"(A new operator, div(kappa grad u): the Laplacian's entries times the mean of kappa_i
and kappa_j.

conductivity: n numbers > 0. mean: "arithmetic" where they are smooth, "harmonic" for jumps.
gradient: of the same points and neighbours: by the product rule then, kappa lap u + grad kappa . grad u.
Raises InvalidInput if sizes disagree or a number is out of range (names the point).)");
}

void bind_supports(py::module_& m) {
  m.def(
      "with_symmetric_supports",
      [](const SchemeLike& what, const Operator& op, int threads) {
        const Scheme one = scheme(what);
        return without_gil([&] { return with_symmetric_supports(one, op, threads); });
      },
      py::arg("scheme"), py::arg("op"), py::arg("threads") = 0,
      R"(A new operator: a zoc operator whose supports differ made symmetric after scaling by
volume, or antisymmetric (gradients).

Points count for one another if either is in the support of the other, with the mean of both
kernels. Supports should vary slowly, as those of local_spacing() do.
scheme: what `op` was assembled with; one with symmetry other than "none". op: all rows.
Raises InvalidInput if the scheme has no symmetry or `op` is not of it or lacks rows.)");
}

py::tuple operator_with_walls(const Operator& laplacian, const Cloud& cloud, const Neighbours& near,
                              const ArrayLike& where, const ArrayLike& normals,
                              const ArrayLike& flux, const ArrayLike& transfer, int threads) {
  FluxWalls walls{.points = points(where, "points", cloud.size()),
                  .normals = positions(normals, "normals")};
  const auto count = static_cast<Eigen::Index>(walls.points.size());
  walls.flux = optional_vector(flux, "flux", count);
  walls.transfer = optional_vector(transfer, "transfer", count);
  WithWalls found = without_gil([&] { return with_walls(laplacian, cloud, near, walls, threads); });
  const auto& remaining = found.remaining.points;
  const py::array_t<double> source(found.source.size(), found.source.data());
  const py::array_t<int> left(static_cast<py::ssize_t>(remaining.size()), remaining.data());
  return py::make_tuple(std::move(found.laplacian), source, left);
}

void bind_walls(py::module_& m) {
  m.def("with_walls", &operator_with_walls, py::arg("laplacian"), py::arg("cloud"), py::arg("near"),
        py::arg("points"), py::arg("normals"), py::arg("flux") = py::none(),
        py::arg("transfer") = py::none(), py::arg("threads") = 0,
        R"(A new operator whose rows at walls, where transfer u + n . grad u = flux, know the slope:
positive stencils, exact on polynomials of degree 2, that let no field grow.

points: m indices. normals: m x d, outward, of any length. flux: m numbers; None: 0.
transfer: m numbers >= 0, for an exchange with what is at flux / transfer; None: 0.
Returns the operator; n numbers, what the flux adds to lap u (to the source of ImplicitDiffusion,
times the diffusivity); and the points whose row could not be made and is as it was: all their
neighbours lie to one side of the normal.
Raises InvalidInput if sizes disagree, a normal is 0, a number is not finite or a point is there
twice.)");
}

}  // namespace

void bind_operator(py::module_& m) {
  bind_rows(m);
  bind_matrices(m);
  bind_functions(m);
  bind_supports(m);
  bind_walls(m);
}

}  // namespace gradpsi::python
