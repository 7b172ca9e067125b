// The extension module gradpsi._core; gradpsi/__init__.py makes a package of it.

#include <system_error>

#include "python/arrays.hpp"

namespace gradpsi::python {
namespace {

py::object stencil_error, solver_error;  // live as long as the interpreter

void translate(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(thrown);
  } catch (const StencilError& e) {
    const py::object error = stencil_error(e.what());
    error.attr("point") = e.point;
    error.attr("neighbours") = e.neighbours;
    error.attr("reciprocal_condition") = e.reciprocal_condition;
    PyErr_SetObject(stencil_error.ptr(), error.ptr());
  } catch (const SolverError& e) {
    const py::object error = solver_error(e.what());
    error.attr("residual") = e.residual;
    PyErr_SetObject(solver_error.ptr(), error.ptr());
  } catch (const std::system_error& e) {
    // OSError makes itself a FileNotFoundError where the number says so.
    const py::tuple arguments = py::make_tuple(e.code().value(), e.what());
    PyErr_SetObject(PyExc_OSError, arguments.ptr());
  }
}

py::object exception(py::module_& m, const char* name, PyObject* base, const char* doc) {
  const std::string full = std::string("gradpsi.") + name;
  auto type = py::reinterpret_steal<py::object>(
      PyErr_NewExceptionWithDoc(full.c_str(), doc, base, nullptr));
  if (!type) throw py::error_already_set();
  m.attr(name) = type;
  return type;
}

void bind_errors(py::module_& m) {
  py::register_exception<InvalidInput>(m, "InvalidInput", PyExc_ValueError).attr("__doc__") =
      "The caller's or the file's mistake: the message says what was expected and what came.";
  stencil_error =
      exception(m, "StencilError", PyExc_RuntimeError,
                R"(A point whose row cannot be computed: its moment system is singular, or it has no
neighbour.

Attributes: point; neighbours, without the point itself; reciprocal_condition, see RowReport.)");
  solver_error = exception(
      m, "SolverError", PyExc_RuntimeError,
      R"(A linear system that could not be solved: singular, not positive definite, no convergence.

Attribute: residual, relative, the last one reached; nan if there was no solution.)");
  py::register_exception_translator(&translate);
}

}  // namespace
}  // namespace gradpsi::python

PYBIND11_MODULE(_core, m) {
  using namespace gradpsi::python;
  const py::object name = m.attr("__name__");
  m.attr("__name__") = "gradpsi";  // where users find what is made here, and help() names it
  m.attr("__version__") = GRADPSI_VERSION;
  bind_errors(m);
  bind_scheme(m);
  bind_cloud(m);
  bind_operator(m);
  bind_interpolate(m);
  bind_tolerance(m);
  bind_vector_calculus(m);
  bind_solver(m);
  bind_diagnosis(m);
  bind_io(m);
  explain_calls(m);
  m.attr("__name__") = name;
}
