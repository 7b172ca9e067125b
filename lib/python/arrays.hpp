#pragma once

// What goes between numpy or scipy and the library. Arguments are copied, results are not.

#include <pybind11/complex.h>
#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <Eigen/SparseCore>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "base/text.hpp"
#include "gradpsi/gradpsi.hpp"

namespace gradpsi::python {

namespace py = pybind11;

inline bool anything(PyObject*) { return true; }

/// Arguments whose type is checked by the functions below, which can say what is wrong with them.
class ArrayLike : public py::object {
 public:
  PYBIND11_OBJECT_DEFAULT(ArrayLike, py::object, anything)
};
class SparseLike : public py::object {
 public:
  PYBIND11_OBJECT_DEFAULT(SparseLike, py::object, anything)
};
class SchemeLike : public py::object {
 public:
  PYBIND11_OBJECT_DEFAULT(SchemeLike, py::object, anything)
};

/// Calls f while other Python threads run.
template <class F>
auto without_gil(F&& f) {
  const py::gil_scoped_release release;
  return f();
}

/// n numbers; `name` is the argument's in messages (so it is below).
/// @throws InvalidInput  if `x` is not of real numbers or has another shape (so do those below)
DenseVector vector(const py::object& x, std::string_view name);
/// `size` numbers; None: empty.
DenseVector optional_vector(const py::object& x, std::string_view name, Eigen::Index size);
/// One number, where `x` is not an array.
std::optional<double> number(const py::object& x, std::string_view name);
/// n x d, or n numbers for points on a line.
Positions positions(const py::object& x, std::string_view name);

/// One field (n) or several (n x k), and what goes back in the same shape.
struct Fields {
  DenseMatrix values;
  bool single;

  Fields(const py::object& x, std::string_view name);
  /// The values, which move away.
  py::array array();
};

/// Indices, or a mask of `size` truth values; None: empty.
std::vector<int> points(const py::object& x, std::string_view name, int size);

/// A copy of a scipy.sparse matrix, or of what scipy makes one of; compressed, columns ascending.
SparseMatrix sparse(const py::object& A, std::string_view name);

/// The scheme, or the one of that name.
Scheme scheme(const py::object& x);

/// What call(a Scheme) makes of one, or call(Schemes) of a sequence.
template <class Call>
py::object one_or_more(const py::object& what, const Call& call) {
  if (py::isinstance<py::str>(what) || !py::isinstance<py::sequence>(what))
    return py::cast(call(scheme(what)));
  std::vector<Scheme> schemes;
  for (const py::handle each : what) schemes.push_back(scheme(py::cast<py::object>(each)));
  return py::cast(call(schemes));
}

/// The value of that name.
/// @throws InvalidInput  listing the valid names, nearest spelling first
template <class Value, std::size_t n>
Value choice(std::string_view what, std::string_view name,
             const std::pair<std::string_view, Value> (&values)[n]) {
  std::vector<std::string> valid;
  for (const auto& [its_name, value] : values) {
    if (its_name == name) return value;
    valid.emplace_back(its_name);
  }
  throw_unknown(what, name, valid);
}

/// An array over memory of `owner`, which it keeps alive.
template <class T>
py::array_t<T> view(const T* data, Eigen::Index size, const py::object& owner,
                    bool writable = false) {
  py::array_t<T> array(size, data, owner);
  if (!writable) array.attr("setflags")(py::arg("write") = false);
  return array;
}
template <class T>
py::array_t<T> view(const Eigen::Matrix<T, Eigen::Dynamic, 1, Eigen::DontAlign>& x,
                    const py::object& owner) {
  return view(x.data(), x.size(), owner);
}

/// A scipy.sparse.csr_matrix over the memory of a compressed matrix that `owner` keeps alive. Its
/// values may be written; its pattern, which the library relies on, may not.
py::object csr(const SparseMatrix& A, const py::object& owner);
/// One that owns its memory.
py::object csr(SparseMatrix&& A);

/// The stages.
void bind_cloud(py::module_& m);
void bind_diagnosis(py::module_& m);
void bind_interpolate(py::module_& m);
void bind_tolerance(py::module_& m);
void bind_io(py::module_& m);
void bind_operator(py::module_& m);
void bind_scheme(py::module_& m);
void bind_solver(py::module_& m);
void bind_vector_calculus(py::module_& m);

/// Has calls of all that is bound say in one sentence which argument is missing, unknown or of another type.
void explain_calls(py::module_& m);

}  // namespace gradpsi::python

/// As signatures show them.
template <>
struct pybind11::detail::handle_type_name<gradpsi::python::ArrayLike> {
  static constexpr auto name = const_name("ArrayLike");
};
template <>
struct pybind11::detail::handle_type_name<gradpsi::python::SparseLike> {
  static constexpr auto name = const_name("scipy.sparse.spmatrix");
};
template <>
struct pybind11::detail::handle_type_name<gradpsi::python::SchemeLike> {
  static constexpr auto name = const_name("Scheme | str");
};
