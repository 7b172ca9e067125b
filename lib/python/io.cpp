// Files.

#include <array>
#include <filesystem>
#include <string>

#include "python/arrays.hpp"

namespace gradpsi::python {
namespace {

using std::filesystem::path;

void add_columns(Table& table, const py::dict& columns) {
  for (const auto& [key, values] : columns) {
    const auto name = key.cast<std::string>();
    table.add(name, vector(py::reinterpret_borrow<py::object>(values), name));
  }
}

/// Fields of n numbers as columns, of n x 2 or n x 3 as vectors.
void add_fields(Table& table, const py::dict& fields) {
  for (const auto& [key, values] : fields) {
    const auto name = key.cast<std::string>();
    const Fields field(py::reinterpret_borrow<py::object>(values), name);
    if (field.single) {
      table.add(name, field.values.col(0));
      continue;
    }
    if (field.values.cols() > 3)
      throw InvalidInput(name + " has " + std::to_string(field.values.cols()) +
                         " components, a vector at most 3");
    std::array<std::string, 3> components;
    for (Eigen::Index a = 0; a < field.values.cols(); ++a) {
      components[a] = name + '_' + "xyz"[a];
      table.add(components[a], field.values.col(a));
    }
    table.add_vector(name, components);
  }
}

py::dict columns(const path& file) {
  const Table table = without_gil([&] { return read_csv(file); });
  py::dict result;
  for (const std::string& name : table.names) {
    const TextColumn* const text = table.text(name);
    result[name.c_str()] = text ? py::cast(text->cells) : py::cast(table.column(name));
  }
  return result;
}

Table table_of(const Cloud& cloud) {
  Table table;
  const char* const names[] = {"x", "y", "z"};
  for (int a = 0; a < cloud.dimension(); ++a) table.add(names[a], cloud.positions().col(a));
  return table;
}

void bind_csv(py::module_& m) {
  m.def("read_csv", &columns, py::arg("file"),
        R"(The columns of a file with a header row, parted by ; tabs , or blanks: arrays by name.

A column with cells that are no numbers, or whole numbers beyond 2^53, is a list of str.
Raises InvalidInput naming file and line, OSError if the file cannot be read.)");
  m.def(
      "write_csv",
      [](const path& file, const py::dict& columns) {
        Table table;
        add_columns(table, columns);
        without_gil([&] { write_csv(file, table); });
      },
      py::arg("file"), py::arg("columns"),
      R"(Writes columns of equal length, arrays by name, with the fewest digits that give the
same doubles again.

Written beside its place and renamed when complete, as all files are: after an error the old one
is still there.
Raises InvalidInput if lengths differ, OSError if the file cannot be written.)");
}

void bind_vtk(py::module_& m) {
  m.def(
      "write_vtu",
      [](const path& file, const Cloud& cloud, const py::dict& fields) {
        Table table = table_of(cloud);
        add_fields(table, fields);
        without_gil([&] { write_vtu(file, table); });
      },
      py::arg("file"), py::arg("cloud"), py::arg("fields") = py::dict(),
      R"(Writes points and fields (arrays of n by name) for ParaView, a VTK unstructured grid.

A field v of vectors, n x 1 to n x 3, is written as a vector of three components, and as v_x, v_y, v_z.

Raises InvalidInput if a field has another length or the name of a coordinate, OSError.)");
  m.def(
      "write_pvd",
      [](const path& file, const std::vector<std::pair<double, path>>& series) {
        without_gil([&] { write_pvd(file, series); });
      },
      py::arg("file"), py::arg("series"),
      "Writes a ParaView collection: files beside it, each with its time, [(time, file), ...].");
}

void bind_matrix_market(py::module_& m) {
  m.def(
      "read_matrix_market",
      [](const path& file) { return csr(without_gil([&] { return read_matrix_market(file); })); },
      py::arg("file"),
      R"(The matrix of a Matrix Market file, a scipy.sparse.csr_matrix, symmetric ones with both
triangles.

Raises InvalidInput naming file and line, also for what other readers let pass: fewer or more
entries than announced, an entry twice, a number that is not finite; OSError if the file cannot
be read.)");
  m.def(
      "write_matrix_market",
      [](const path& file, const SparseLike& matrix) {
        const SparseMatrix A = sparse(matrix, "matrix");
        without_gil([&] { write_matrix_market(file, A); });
      },
      py::arg("file"), py::arg("matrix"),
      R"(Writes a scipy.sparse matrix as Matrix Market, coordinate real general, explicit zeros
included.

Digits are the fewest that give the same doubles again. Raises OSError if the file cannot be
written.)");
}

}  // namespace

void bind_io(py::module_& m) {
  bind_csv(m);
  bind_vtk(m);
  bind_matrix_market(m);
}

}  // namespace gradpsi::python
