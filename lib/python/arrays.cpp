#include "python/arrays.hpp"

#include <algorithm>
#include <limits>
#include <memory>
#include <string>

namespace gradpsi::python {
namespace {

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

std::string shape(const py::array& x) { return py::str(x.attr("shape")); }

/// Whether an array, or one of a list of them, has masked elements.
bool is_masked(const py::handle x) {
  const py::object ma = py::module_::import("numpy").attr("ma");
  if (ma.attr("is_masked")(x).cast<bool>()) return true;
  if (!py::isinstance<py::list>(x) && !py::isinstance<py::tuple>(x)) return false;
  const py::object masked_array = ma.attr("MaskedArray");
  return std::ranges::any_of(x, [&](const py::handle each) {
    return py::isinstance(each, masked_array) && is_masked(each);
  });
}

/// numpy and scipy would uncover what a mask hides.
void refuse_mask(const py::object& x, std::string_view name) {
  if (is_masked(x))
    throw InvalidInput(std::string(name) +
                       " has masked elements: fill them, or leave their points out");
}

py::array numpy_array(const py::object& x, std::string_view name) {
  refuse_mask(x, name);
  return py::module_::import("numpy").attr("asarray")(x);
}

Doubles numbers(const py::object& x, std::string_view name) {
  const py::array array = numpy_array(x, name);
  // Others would be converted, too: complex numbers by dropping half of each, text by reading it.
  if (std::string_view("biuf").find(array.dtype().kind()) == std::string_view::npos)
    throw InvalidInput(std::string(name) + " must be real numbers, not of type " +
                       std::string(py::str(array.dtype())));
  return array;
}

[[noreturn]] void throw_shape(std::string_view name, const std::string& expected,
                              const py::array& x) {
  throw InvalidInput(std::string(name) + " must be " + expected + ", not of shape " + shape(x));
}

SparseMatrix copy(const py::object& csr) {
  const auto offsets = csr.attr("indptr").cast<py::array_t<int>>();
  const auto indices = csr.attr("indices").cast<py::array_t<int>>();
  const auto data = csr.attr("data").cast<Doubles>();
  const auto [rows, columns] = csr.attr("shape").cast<std::pair<int, int>>();
  return Eigen::Map<const SparseMatrix>(rows, columns, data.size(), offsets.data(), indices.data(),
                                        data.data());
}

py::object csr(const SparseMatrix& A, const py::object& owner, bool pattern_writable) {
  const auto parts = py::make_tuple(view(A.valuePtr(), A.nonZeros(), owner, true),
                                    view(A.innerIndexPtr(), A.nonZeros(), owner, pattern_writable),
                                    view(A.outerIndexPtr(), A.rows() + 1, owner, pattern_writable));
  py::object result =
      py::module_::import("scipy.sparse")
          .attr("csr_matrix")(parts, py::arg("shape") = py::make_tuple(A.rows(), A.cols()),
                              py::arg("copy") = false);
  result.attr("has_canonical_format") = true;  // sorted, each entry once
  return result;
}

}  // namespace

DenseVector vector(const py::object& x, std::string_view name) {
  const Doubles array = numbers(x, name);
  if (array.ndim() != 1) throw_shape(name, "n numbers", array);
  return Eigen::Map<const DenseVector>(array.data(), array.size());
}

DenseVector optional_vector(const py::object& x, std::string_view name, Eigen::Index size) {
  if (x.is_none()) return {};
  const DenseVector result = vector(x, name);
  // The library takes an empty vector for none.
  if (result.size() != size)
    throw InvalidInput(std::string(name) + " has " + std::to_string(result.size()) +
                       " entries, expected " + std::to_string(size));
  return result;
}

std::optional<double> number(const py::object& x, std::string_view name) {
  const Doubles array = numbers(x, name);
  if (array.ndim() > 0) return std::nullopt;
  return *array.data();
}

Positions positions(const py::object& x, std::string_view name) {
  const Doubles array = numbers(x, name);
  if (array.ndim() != 1 && array.ndim() != 2) throw_shape(name, "n or n x d numbers", array);
  return Eigen::Map<const Positions>(array.data(), array.shape(0),
                                     array.ndim() == 1 ? 1 : array.shape(1));
}

Fields::Fields(const py::object& x, std::string_view name) {
  const Doubles array = numbers(x, name);
  single = array.ndim() == 1;
  if (!single && array.ndim() != 2) throw_shape(name, "n or n x k numbers", array);
  values = Eigen::Map<const Positions>(array.data(), array.shape(0), single ? 1 : array.shape(1));
}

py::array Fields::array() {
  const py::ssize_t size = values.size();
  const py::array result = py::cast(std::move(values));
  return single ? py::array(result.attr("reshape")(size)) : result;
}

std::vector<int> points(const py::object& x, std::string_view name, int size) {
  if (x.is_none()) return {};
  py::array array = numpy_array(x, name);
  if (array.ndim() != 1) throw_shape(name, "indices or a mask", array);
  if (array.dtype().kind() == 'b') {
    if (array.size() != size)
      throw InvalidInput(std::string(name) + " is a mask of " + std::to_string(array.size()) +
                         " points, there are " + std::to_string(size));
    array = array.attr("nonzero")().cast<py::tuple>()[0];
  } else if (array.size() == 0) {
    return {};  // numpy takes an empty list for one of doubles
  }
  if (std::string_view("iu").find(array.dtype().kind()) == std::string_view::npos)
    throw InvalidInput(std::string(name) + " must be indices or a mask, not of type " +
                       std::string(py::str(array.dtype())));
  std::vector<int> result;
  result.reserve(array.size());
  if (array.dtype().kind() == 'u') array = array.attr("clip")(0, std::numeric_limits<int>::max());
  for (const auto indices =
           py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>(array);
       const std::int64_t i : std::span(indices.data(), indices.size())) {
    if (i < 0 || i >= size)
      throw InvalidInput(std::string(name) + " has point " + std::to_string(i) + ", there are " +
                         std::to_string(size));
    result.push_back(static_cast<int>(i));
  }
  return result;
}

SparseMatrix sparse(const py::object& A, std::string_view name) {
  refuse_mask(A, name);
  py::object csr = py::module_::import("scipy.sparse").attr("csr_matrix")(A);
  numbers(csr.attr("data"), name);
  if (csr.attr("nnz").cast<std::int64_t>() > std::numeric_limits<int>::max() ||
      std::ranges::max(csr.attr("shape").cast<std::array<std::int64_t, 2>>()) >
          std::numeric_limits<int>::max())
    throw InvalidInput(std::string(name) + " is too large for indices of 32 bits");
  csr.attr("check_format")(true);  // it may have been written by hand
  if (!csr.attr("has_canonical_format").cast<bool>()) {
    csr = csr.attr("copy")();
    csr.attr("sum_duplicates")();
  }
  return copy(csr);
}

Scheme scheme(const py::object& x) {
  if (py::isinstance<Scheme>(x)) return x.cast<Scheme>();
  if (!py::isinstance<py::str>(x))
    throw py::type_error("a scheme is a Scheme or its name, not " + std::string(py::repr(x)));
  return x.cast<std::string>();
}

py::object csr(const SparseMatrix& A, const py::object& owner) { return csr(A, owner, false); }

py::object csr(SparseMatrix&& A) {
  auto matrix = std::make_unique<SparseMatrix>(std::move(A));
  const SparseMatrix& kept = *matrix;
  const py::capsule owner(matrix.release(), [](void* p) { delete static_cast<SparseMatrix*>(p); });
  return csr(kept, owner, true);
}

}  // namespace gradpsi::python
