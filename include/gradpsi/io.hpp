#pragma once

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gradpsi/cloud.hpp"
#include "gradpsi/matrix.hpp"
#include "gradpsi/table.hpp"

#pragma GCC visibility push(default)
namespace gradpsi {

// Numbers are read and written in the C notation whatever the locale, with the fewest digits that
// give the same double again. Files are written beside their final place and renamed when
// complete: after an error the old file is still there, whole.

/// A file of text with a header row and a row a point. Cells are parted by ; tabs , or blanks, of which the first
/// counts that gives header and rows as many cells. Accepted are quotes around names and cells, decimal commas where
/// commas do not part cells, exponents with D, lines of remarks (# or //), the last of them as the header where
/// there is no other, a row of units, CRLF, a byte-order mark, and empty lines at the end; a final line end may be
/// missing. A first column without a name is `index`. `nan` and `inf` are numbers here; a Cloud refuses them.
/// Columns with cells that are no numbers are Table::texts, and refused where they are asked for.
/// @throws InvalidInput  naming file and line: no header, what is not UTF-8 text, a name twice, a row with too many
///   or too few columns, a line above 1 MiB, an empty line before the end
/// @throws std::system_error  if the file cannot be read
Table read_csv(const std::filesystem::path& file);

/// Part `part` of a file's rows, cut into `parts` of about as many bytes, for processes that share a file:
/// together they are the rows of read_csv(file), in order, each once; all have the names.
/// @param file   a regular file
/// @param part   0 to parts - 1
/// @param parts  at least 1
/// @param names  of the columns of a file without a header
/// @throws InvalidInput  as above, of this part's rows; if part is out of range; if there are names and a header
/// @throws std::system_error  as above; if parts > 1 and it is no file but a pipe
Table read_csv(const std::filesystem::path& file, int part, int parts,
               const std::vector<std::string>& names = {});

/// make_cloud(read_csv(file)): points in open space.
Cloud read_cloud(const std::filesystem::path& file);

/// Writes a text as a file.
/// @throws std::system_error  if the file cannot be written (so do those below)
void write_text(const std::filesystem::path& file, std::string_view text);

/// Writes a header row and the values, so that read_csv() reads the same table. Names are written as they
/// are, in quotes if need be; they must not hold commas or line ends.
void write_csv(const std::filesystem::path& file, const Table& table);

/// The same for rows that come piece by piece: next() gives tables of the same columns, one below the other,
/// the first of which gives the names, until it returns false.
void write_csv(const std::filesystem::path& file, const std::function<bool(Table&)>& next);

/// Points as vertices of a VTK unstructured grid (binary XML, for ParaView): x, y, z are the
/// positions, missing ones 0, and every other column is point data, as are the table's vectors, with three
/// components each.
/// @throws InvalidInput  if there is no column x
void write_vtu(const std::filesystem::path& file, const Table& table);

/// A .pvtu: pieces of one cloud, each written by write_vtu() with these columns, in files beside it.
/// @param file    where to
/// @param names   of the columns, x, y, z among them or not
/// @param pieces  the files beside it
void write_pvtu(const std::filesystem::path& file, const std::vector<std::string>& names,
                const std::vector<std::filesystem::path>& pieces);

/// A ParaView collection (.pvd): files beside it, each with its time.
void write_pvd(const std::filesystem::path& file,
               const std::vector<std::pair<double, std::filesystem::path>>& series);

/// A file format of tables, told by how a file's name ends.
struct TableFormat {
  std::string_view ending;  ///< ".csv"
  /// Part `part` of `parts` of the rows, as read_csv() gives it; null: the format is only written.
  Table (*read)(const std::filesystem::path& file, int part, int parts,
                const std::vector<std::string>& names);
  /// Writes the whole table, as write_csv() does.
  void (*write)(const std::filesystem::path& file, const Table& table);
};

/// All formats, the first being that of files whose ending does not tell one that can be read: CSV.
std::span<const TableFormat> table_formats();

/// A file's rows, or a part of them as read_csv() gives it, in the format that its ending tells.
/// @throws  as read_csv()
Table read_table(const std::filesystem::path& file, int part = 0, int parts = 1,
                 const std::vector<std::string>& names = {});

/// Writes a table in the format that the ending tells.
/// @throws InvalidInput  listing the endings, if it tells none; as the format's function
void write_table(const std::filesystem::path& file, const Table& table);

/// Matrix Market, `coordinate real general`, 1-based, row by row, explicit zeros included.
void write_matrix_market(const std::filesystem::path& file, const SparseMatrix& matrix);

/// The same for several files: none is replaced unless all could be written.
/// @throws InvalidInput  if the numbers of files and matrices differ
void write_matrix_market(const std::vector<std::filesystem::path>& files,
                         const std::vector<SparseMatrix>& matrices);

/// Reads a Matrix Market file: `matrix coordinate`, real, integer or pattern (all ones), general,
/// symmetric or skew-symmetric (both triangles are filled); columns ascend. Memory is taken for rows
/// and for entries that are there, so rows beyond ten million must have an entry in ten of them, on
/// average; columns cost nothing.
/// @throws InvalidInput  naming file and line: another format, a number that is none or not finite, an
///   index out of range, an entry on the wrong side of a symmetric matrix, more entries than announced or
///   than 2^31 - 1, too many rows for them; naming the file: fewer entries than announced; naming the
///   entry: one that is there twice
/// @throws std::system_error  if the file cannot be read
SparseMatrix read_matrix_market(const std::filesystem::path& file);

}  // namespace gradpsi
#pragma GCC visibility pop
