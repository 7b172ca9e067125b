#include <algorithm>
#include <limits>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gradpsi/error.hpp"
#include "gradpsi/io.hpp"
#include "io/file.hpp"
#include "io/text.hpp"

namespace gradpsi {
namespace {

using std::filesystem::path;

void write_entries(Output& out, const SparseMatrix& matrix) {
  out << "%%MatrixMarket matrix coordinate real general\n"
      << static_cast<int>(matrix.rows()) << " " << static_cast<int>(matrix.cols()) << " "
      << static_cast<int>(matrix.nonZeros()) << "\n";
  for (int i = 0; i < matrix.rows(); ++i)
    for (SparseMatrix::InnerIterator entry(matrix, i); entry; ++entry)
      out << i + 1 << " " << static_cast<int>(entry.col()) + 1 << " " << entry.value() << "\n";
}

/// Each row takes memory, whether it has entries or not, so that a file of a hundred bytes must not ask for
/// two thousand million of them: see read_matrix_market().
constexpr int few_rows = 10'000'000, rows_per_entry = 10;

/// What the first line of a Matrix Market file says.
struct MarketHeader {
  bool pattern = false;
  int mirrored = 0;  // 1: symmetric, -1: skew-symmetric
};
MarketHeader market_header(std::string_view line, const std::string& place) {
  std::string lower(line.substr(0, 200));
  for (char& c : lower) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  const auto w = words(lower);
  if (w.size() != 5 || w[0] != "%%matrixmarket" || w[1] != "matrix" || w[2] != "coordinate")
    throw InvalidInput(place + "expected '%%MatrixMarket matrix coordinate ..', not '" +
                       excerpt(line) + "'");
  if (w[3] != "real" && w[3] != "integer" && w[3] != "pattern")
    throw InvalidInput(place + "numbers must be real, integer or pattern, not " + excerpt(w[3]));
  if (w[4] != "general" && w[4] != "symmetric" && w[4] != "skew-symmetric")
    throw InvalidInput(place + "the matrix must be general, symmetric or skew-symmetric, not " +
                       excerpt(w[4]));
  return {w[3] == "pattern", w[4] == "symmetric" ? 1 : w[4] == "general" ? 0 : -1};
}

using Entry = Eigen::Triplet<double, int>;

/// The entries as rows, sorted; none twice. Takes memory for rows and entries, not for columns.
SparseMatrix matrix_of(std::vector<Entry> entries, int rows, int columns, const path& file) {
  const auto place = [](const Entry& e) { return std::pair(e.row(), e.col()); };
  if (!std::ranges::is_sorted(entries, {}, place)) std::ranges::sort(entries, {}, place);
  if (const auto twice = std::ranges::adjacent_find(entries, {}, place); twice != entries.end())
    throw InvalidInput(file.string() + ": entry (" + std::to_string(twice->row() + 1) + ", " +
                       std::to_string(twice->col() + 1) + ") is there twice");
  SparseMatrix matrix(rows, columns);
  matrix.resizeNonZeros(std::ssize(entries));
  int* const outer = matrix.outerIndexPtr();
  for (std::size_t k = 0; k < entries.size(); ++k) {
    ++outer[entries[k].row() + 1];
    matrix.innerIndexPtr()[k] = entries[k].col();
    matrix.valuePtr()[k] = entries[k].value();
  }
  std::partial_sum(outer, outer + rows + 1, outer);
  return matrix;
}

/// A Matrix Market file after its first line, entry by entry.
class MarketReader {
 public:
  explicit MarketReader(const path& file) : file_(file), lines_(file) {
    if (!lines_.next(line_)) throw InvalidInput(file.string() + ":1: the file is empty");
    header_ = market_header(line_, lines_.place());
    read_sizes();
  }

  SparseMatrix matrix() {
    std::vector<Entry> entries;  // grows with what is read, not with what is announced
    int count = 0;
    for (auto w = next_words(); !w.empty(); w = next_words()) {
      if (count++ == announced_)
        throw InvalidInput(lines_.place() + "more entries than the " + std::to_string(announced_) +
                           " announced");
      append(w, entries);
      if (entries.size() > most)
        throw InvalidInput(lines_.place() + "the matrix has more than 2^31 - 1 entries");
    }
    if (count < announced_)
      throw InvalidInput(file_.string() + ": " + std::to_string(count) + " entries where " +
                         std::to_string(announced_) + " are announced");
    return matrix_of(std::move(entries), rows_, columns_, file_);
  }

 private:
  static constexpr int most = std::numeric_limits<int>::max();

  /// Of the next line that is not a comment; none at the end.
  std::vector<std::string_view> next_words() {
    while (lines_.next(line_)) {
      if (line_.starts_with('%')) continue;
      if (auto w = words(line_); !w.empty()) return w;
    }
    return {};
  }

  void read_sizes() {
    const auto sizes = next_words();
    const std::string place = lines_.place();
    if (sizes.size() != 3) throw InvalidInput(place + "expected ROWS COLUMNS ENTRIES");
    rows_ = whole_number(sizes[0], 0, most - 1, place);
    columns_ = whole_number(sizes[1], 0, most - 1, place);
    announced_ = whole_number(sizes[2], 0, most, place);
    if (rows_ > few_rows && rows_ / rows_per_entry > announced_)
      throw InvalidInput(place + std::to_string(rows_) + " rows for " + std::to_string(announced_) +
                         " entries: above " + std::to_string(few_rows) +
                         " rows there must be an entry for every " +
                         std::to_string(rows_per_entry));
    if (header_.mirrored != 0 && rows_ != columns_)
      throw InvalidInput(place + "a symmetric matrix must be square");
  }

  /// The entry of a line and, if it has one, that in the other triangle.
  void append(const std::vector<std::string_view>& w, std::vector<Entry>& entries) const {
    const std::string place = lines_.place();
    if (w.size() != (header_.pattern ? 2 : 3))
      throw InvalidInput(place + "expected ROW COLUMN" + (header_.pattern ? "" : " VALUE"));
    const int i = whole_number(w[0], 1, rows_, place) - 1;
    const int j = whole_number(w[1], 1, columns_, place) - 1;
    const double value = header_.pattern ? 1 : number(w[2], place);
    if (header_.mirrored != 0 && j > i)
      throw InvalidInput(place + "only the lower triangle of a symmetric matrix is stored");
    if (header_.mirrored < 0 && j == i)
      throw InvalidInput(place + "a skew-symmetric matrix has no diagonal");
    entries.emplace_back(i, j, value);
    if (header_.mirrored != 0 && i != j) entries.emplace_back(j, i, header_.mirrored * value);
  }

  path file_;
  Lines lines_;
  std::string_view line_;
  MarketHeader header_;
  int rows_ = 0, columns_ = 0, announced_ = 0;
};

}  // namespace

void write_matrix_market(const path& file, const SparseMatrix& matrix) {
  write_file(file, [&](Output& out) { write_entries(out, matrix); });
}

void write_matrix_market(const std::vector<path>& files,
                         const std::vector<SparseMatrix>& matrices) {
  if (files.size() != matrices.size())
    throw InvalidInput(std::to_string(files.size()) + " files for " +
                       std::to_string(matrices.size()) + " matrices");
  std::vector<Output> outputs;
  for (std::size_t k = 0; k < files.size(); ++k) {
    outputs.emplace_back(files[k]);
    write_entries(outputs.back(), matrices[k]);
    outputs.back().finish();
  }
  for (Output& out : outputs) out.commit();
}

SparseMatrix read_matrix_market(const path& file) { return MarketReader(file).matrix(); }

}  // namespace gradpsi
