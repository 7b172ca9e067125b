#include "studies/spmv.hpp"

#include <algorithm>
#include <gradpsi/gradpsi.hpp>
#include <iostream>
#include <limits>

#include "common/chunks.hpp"

namespace gradpsi::apps::spmv {

namespace {

/// The sum of an array, as fast as it can be read: additions that do not wait for one another.
double read_all(const Eigen::VectorXd& array, int threads) {
  constexpr int chunk = 1 << 14, lanes = 16;
  Eigen::VectorXd sums(array.size() / chunk + 1);
  in_chunks(static_cast<int>(array.size()), chunk, threads, [&](int begin, int end) {
    Eigen::Array<double, lanes, 1> sum = Eigen::Array<double, lanes, 1>::Zero();
    for (int k = begin; k + lanes <= end; k += lanes) sum += array.segment<lanes>(k).array();
    sums[begin / chunk] = sum.sum();
  });
  return sums.sum();
}

void triad(const Eigen::VectorXd& b, const Eigen::VectorXd& c, Eigen::VectorXd& a, int threads) {
  in_chunks(static_cast<int>(a.size()), 1 << 16, threads, [&](int begin, int end) {
    a.segment(begin, end - begin) =
        b.segment(begin, end - begin) + 3 * c.segment(begin, end - begin);
  });
}

/// Shows measurements as they come; what memory can do is the first.
class Report {
 public:
  /// @param entries  of the matrix
  /// @param bytes    what its product has to read and write
  Report(double entries, double bytes, Timer& timer, const Show& show)
      : entries_(entries), bytes_(bytes), timer_(timer), show_(show) {}
  /// Of the memory; the first is the roof.
  void memory(const char* what, double bytes, const std::function<void()>& work) {
    const double seconds = timer_.seconds(work);
    if (roof_ == 0) roof_ = bytes / seconds;
    show_({what, std::numeric_limits<double>::quiet_NaN(), bytes / seconds, roof_});
  }
  /// A product of `count` vectors; `bytes` is what it has to read and write.
  void product(const char* what, double bytes, const std::function<void()>& multiply,
               int count = 1) const {
    const double seconds = timer_.seconds(multiply);
    show_({what, 1e9 * seconds / entries_ / count, bytes / seconds, roof_});
  }
  double bytes() const { return bytes_; }

 private:
  double entries_, bytes_, roof_ = 0;
  Timer& timer_;
  const Show& show_;
};

/// As much memory as the matrix takes, up to 2 GB: what fits a cache is compared with the cache.
void measure_roof(Report& report, int threads) {
  const auto doubles = static_cast<Eigen::Index>(std::min(report.bytes() / 8, double(1 << 28))) + 1;
  const Eigen::VectorXd array = Eigen::VectorXd::Constant(doubles, 1e-3);
  double sum = 0;
  report.memory("reading that many bytes (roof)", 8.0 * static_cast<double>(doubles),
                [&] { sum += read_all(array, threads); });
  Eigen::VectorXd a(doubles / 3 + 1), b = a.setOnes(), c = a;
  report.memory("triad, a = b + 3 c", 24.0 * static_cast<double>(a.size()),
                [&] { triad(b, c, a, threads); });
  if (!(sum > 0)) std::cout << ' ';  // so that the sums are needed
}

void measure_eigen(const SparseMatrix& A, const Eigen::VectorXd& x, int threads,
                   const Report& report) {
  Eigen::VectorXd y(A.rows());
  Eigen::setNbThreads(thread_count(threads));
  report.product("Eigen, row-major", report.bytes(), [&] { y.noalias() = A * x; });
  const Eigen::SparseMatrix<double> by_columns = A;
  report.product("Eigen, column-major (one thread)", report.bytes(),
                 [&] { y.noalias() = by_columns * x; });
}

/// The product by the library, timed.
Eigen::VectorXd measure_ours(const SparseMatrix& A, const Eigen::VectorXd& x, bool symmetric,
                             int threads, const Report& report) {
  const auto entries = static_cast<double>(A.nonZeros()), rows = static_cast<double>(A.rows());
  const double vectors = 8 * (rows + static_cast<double>(A.cols()));
  Eigen::VectorXd ours(A.rows()), y(A.rows());
  report.product("gradpsi", report.bytes(), [&] { multiply(A, x, ours, threads); });
  const SingleSparseMatrix single = A.cast<float>();
  report.product("gradpsi, values in single precision", report.bytes() - 4 * entries,
                 [&] { multiply(single, x, y, threads); });
  const Eigen::MatrixXd X = x.replicate(1, 4);
  Eigen::MatrixXd Y;
  report.product(
      "gradpsi, four vectors, each", report.bytes() + 3 * vectors,
      [&] { multiply(A, X, Y, threads); }, 4);
  if (symmetric) {
    const SparseMatrix upper = A.triangularView<Eigen::Upper>();
    report.product("gradpsi, upper triangle only",
                   12 * static_cast<double>(upper.nonZeros()) + 4 * rows + vectors,
                   [&] { multiply_symmetric(upper, x, y, threads); });
  }
  return ours;
}

/// Largest difference from Eigen's product, of sum |a| |x|.
double difference(const SparseMatrix& A, const Eigen::VectorXd& x, const Eigen::VectorXd& product) {
  const Eigen::VectorXd scale = A.cwiseAbs() * x.cwiseAbs();
  return (product - A * x).cwiseAbs().cwiseQuotient(scale.cwiseMax(1e-300)).maxCoeff();
}

}  // namespace

double measure(const SparseMatrix& A, bool symmetric, int threads, Timer& timer, const Show& show) {
  const auto entries = static_cast<double>(A.nonZeros()), rows = static_cast<double>(A.rows());
  const double vectors = rows + static_cast<double>(A.cols());
  Report report(entries, 12 * entries + 4 * rows + 8 * vectors, timer, show);
  measure_roof(report, threads);
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(A.cols(), -1, 1);
  measure_eigen(A, x, threads, report);
  return difference(A, x, measure_ours(A, x, symmetric, threads, report));
}

}  // namespace gradpsi::apps::spmv
