// Any bytes as a Matrix Market file: refused as the interface says, or a sound matrix that can be
// written and read again.

#include <algorithm>
#include <gradpsi/gradpsi.hpp>
#include <string_view>

#include "fuzz.hpp"

using namespace gradpsi;

namespace {

void require_sound(const SparseMatrix& matrix) {
  require(matrix.isCompressed(), "compressed");
  const int* const outer = matrix.outerIndexPtr();
  require(outer[0] == 0 && outer[matrix.rows()] == matrix.nonZeros(), "rows fill the arrays");
  for (int i = 0; i < matrix.rows(); ++i) {
    require(outer[i] <= outer[i + 1], "rows are one behind the other");
    for (int k = outer[i]; k < outer[i + 1]; ++k) {
      const int j = matrix.innerIndexPtr()[k];
      require(j >= 0 && j < matrix.cols(), "columns are in range");
      require(k == outer[i] || matrix.innerIndexPtr()[k - 1] < j, "columns ascend");
      require(std::isfinite(matrix.valuePtr()[k]), "values are finite");
    }
  }
}

void require_same(const SparseMatrix& a, const SparseMatrix& b) {
  require(a.rows() == b.rows() && a.cols() == b.cols() && a.nonZeros() == b.nonZeros(),
          "sizes survive");
  for (int i = 0; i <= a.rows(); ++i)
    require(a.outerIndexPtr()[i] == b.outerIndexPtr()[i], "so do rows");
  for (Eigen::Index k = 0; k < a.nonZeros(); ++k)
    require(a.innerIndexPtr()[k] == b.innerIndexPtr()[k] && same(a.valuePtr()[k], b.valuePtr()[k]),
            "and entries");
}

/// Whether a number of more than five digits stands in the sizes, or in the comments before them: rows and
/// columns that are announced take memory and time, empty ones too, of which runs should be spared.
bool announces_much(std::string_view text) {
  bool is_banner = true, are_sizes = false;
  while (!text.empty() && !are_sizes) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    int digits = 0;
    for (const char c : line) {
      digits = c >= '0' && c <= '9' ? digits + 1 : 0;
      if (digits > 5) return true;
    }
    are_sizes =
        !is_banner && !line.starts_with('%') && line.find_first_not_of(" \t\r") != line.npos;
    is_banner = false;
  }
  return false;
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (announces_much({reinterpret_cast<const char*>(data), size})) return 0;
  static MemoryFile file, copy;
  file.assign(data, size);
  try {
    const SparseMatrix matrix = read_matrix_market(file.path());
    require_sound(matrix);
    write_matrix_market(copy.path(), matrix);
    try {
      require_same(matrix, read_matrix_market(copy.path()));
    } catch (const InvalidInput& error) {
      require(false, error.what());
    }
  } catch (const InvalidInput&) {
  }
  return 0;
}
