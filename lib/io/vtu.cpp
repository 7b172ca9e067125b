#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gradpsi/io.hpp"
#include "io/file.hpp"
#include "io/table.hpp"

namespace gradpsi {
namespace {

using std::filesystem::path;

/// Bytes in base 64 (RFC 4648), three at a time.
std::string base64(std::span<const std::byte> bytes) {
  static constexpr char digits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t triple = 0;
    for (std::size_t k = 0; k < 3; ++k)
      triple = triple << 8 | (k < count ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0);
    for (std::size_t k = 0; k < 4; ++k)
      text += k <= count ? digits[triple >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// A VTK data array: its size in bytes, then the bytes.
template <class T>
void write_array(Output& out, std::string_view attributes, const std::vector<T>& values) {
  const std::uint64_t size = values.size() * sizeof(T);
  out << "<DataArray " << attributes << " format=\"binary\">"
      << base64(std::as_bytes(std::span(&size, 1))) << base64(std::as_bytes(std::span(values)))
      << "</DataArray>\n";
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '"')
      result += "&quot;";
    else
      result += c;
  }
  return result;
}

/// Three columns, 0 for a name that is empty, row by row.
std::vector<double> interleaved(const Table& table, const std::array<std::string, 3>& columns) {
  const auto n = static_cast<std::size_t>(table.values.rows());
  std::vector<double> result(3 * n, 0.0);
  for (std::size_t a = 0; a < 3; ++a) {
    if (columns[a].empty()) continue;
    const DenseVector x = table.column(columns[a]);
    for (std::size_t i = 0; i < n; ++i) result[3 * i + a] = x[i];
  }
  return result;
}

std::string vector_attributes(const std::string& name) {
  return "type=\"Float64\" Name=\"" + escaped(name) + "\" NumberOfComponents=\"3\"";
}

}  // namespace

void write_vtu(const path& file, const Table& table) {
  const auto n = static_cast<std::size_t>(table.values.rows());
  std::array<std::string, 3> coordinates = {"x"};
  for (std::size_t a = 1; a < 3; ++a)
    if (table.has(axis_names[a])) coordinates[a] = axis_names[a];
  const std::vector<double> points = interleaved(table, coordinates);
  std::vector<std::int32_t> vertices(n), ends(n);
  for (std::size_t i = 0; i < n; ++i) vertices[i] = i, ends[i] = i + 1;
  const std::vector<std::uint8_t> types(n, 1);  // VTK_VERTEX

  write_file(file, [&](Output& out) {
    const auto count = std::to_string(n);
    out << "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\""
        << " byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<UnstructuredGrid>\n"
        << "<Piece NumberOfPoints=\"" << count << "\" NumberOfCells=\"" << count << "\">\n"
        << "<PointData>\n";
    for (std::size_t c = 0; c < table.names.size(); ++c) {
      if (std::ranges::find(axis_names, table.names[c]) != axis_names.end()) continue;
      if (table.text(table.names[c])) continue;
      const auto column = table.values.col(static_cast<Eigen::Index>(c));
      write_array(out, "type=\"Float64\" Name=\"" + escaped(table.names[c]) + "\"",
                  std::vector<double>(column.begin(), column.end()));
    }
    for (const TableVector& vector : table.vectors)
      write_array(out, vector_attributes(vector.name), interleaved(table, vector.columns));
    out << "</PointData>\n<Points>\n";
    write_array(out, vector_attributes("Points"), points);
    out << "</Points>\n<Cells>\n";
    write_array(out, "type=\"Int32\" Name=\"connectivity\"", vertices);
    write_array(out, "type=\"Int32\" Name=\"offsets\"", ends);
    write_array(out, "type=\"UInt8\" Name=\"types\"", types);
    out << "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
  });
}

void write_pvtu(const path& file, const std::vector<std::string>& names,
                const std::vector<path>& pieces) {
  write_file(file, [&](Output& out) {
    out << "<?xml version=\"1.0\"?>\n<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\""
        << " byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
        << "<PUnstructuredGrid GhostLevel=\"0\">\n<PPointData>\n";
    for (const std::string& name : names)
      if (std::ranges::find(axis_names, name) == axis_names.end())
        out << "<PDataArray type=\"Float64\" Name=\"" << escaped(name) << "\"/>\n";
    out << "</PPointData>\n<PPoints>\n"
        << "<PDataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"/>\n</PPoints>\n";
    for (const path& piece : pieces)
      out << "<Piece Source=\"" << escaped(piece.filename().string()) << "\"/>\n";
    out << "</PUnstructuredGrid>\n</VTKFile>\n";
  });
}

void write_pvd(const path& file, const std::vector<std::pair<double, path>>& series) {
  write_file(file, [&](Output& out) {
    out << "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\">\n<Collection>\n";
    for (const auto& [time, member] : series)
      out << "<DataSet timestep=\"" << time << "\" file=\"" << escaped(member.filename().string())
          << "\"/>\n";
    out << "</Collection>\n</VTKFile>\n";
  });
}

}  // namespace gradpsi
