#include "solve/row_correction.hpp"

#include <exception>
#include <utility>
#include <vector>

#include "base/resize.hpp"
#include "matrix/checks.hpp"
#include "matrix/csr.hpp"

namespace gradpsi {
namespace {

/// The block of these rows and columns.
SparseMatrix block(const SparseMatrix& A, const std::vector<int>& rows) {
  std::vector<int> place(A.rows(), -1);
  for (std::size_t k = 0; k < rows.size(); ++k) place[rows[k]] = static_cast<int>(k);
  std::vector<Eigen::Triplet<double>> entries;
  for (const int i : rows)
    for (SparseMatrix::InnerIterator a(A, i); a; ++a)
      if (place[a.col()] >= 0) entries.emplace_back(place[i], place[a.col()], a.value());
  const auto count = static_cast<Eigen::Index>(rows.size());
  SparseMatrix result(count, count);
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

}  // namespace

void RowCorrection::prepare(const LinearSystem& system, std::vector<int> rows) {
  rows_ = std::move(rows);
  SparseMatrix among = block(system.A, rows_);
  if (!share_pattern(among, among_)) factor_.reset();
  among_.swap(among);
  if (rows_.empty()) return;
  try {
    if (!factor_)
      factor_.emplace(among_, Elimination{}, system.options.memory, system.options.threads);
    factor_->factorise(among_);
  } catch (const std::exception&) {  // singular or too large: without, then
    factor_.reset();
  }
  resize(residuals_, among_.rows());
  resize(corrections_, among_.rows());
}

void RowCorrection::correct(const LinearSystem& system, const double* r, double* z) {
  if (!factor_) return;
  for (std::size_t k = 0; k < rows_.size(); ++k)
    residuals_[k] = r[rows_[k]] - row_product(system.A, rows_[k], z);
  factor_->solve(residuals_.data(), corrections_.data(), 1);
  for (std::size_t k = 0; k < rows_.size(); ++k) z[rows_[k]] += corrections_[k];
}

}  // namespace gradpsi
