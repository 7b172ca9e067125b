// gradpsi spmv: how fast a matrix of a file is multiplied, by which means, beside the memory's own speed.

#include <unistd.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <gradpsi/gradpsi.hpp>
#include <iostream>
#include <memory>

#include "../../lib/base/parallel.hpp"
#include "commands.hpp"
#include "common/timing.hpp"

namespace gradpsi::apps {

namespace {

using gradpsi::SparseMatrix;
using std::filesystem::path;

struct Given {
  path matrix;
  int threads = 0;
};

/// The sum of an array, as fast as it can be read: additions that do not wait for one another.
double read_all(const Eigen::VectorXd& array, int threads) {
  constexpr int chunk = 1 << 14, lanes = 16;
  Eigen::VectorXd sums(array.size() / chunk + 1);
  gradpsi::parallel_chunks(static_cast<int>(array.size()), chunk, threads, [&](int begin, int end) {
    Eigen::Array<double, lanes, 1> sum = Eigen::Array<double, lanes, 1>::Zero();
    for (int k = begin; k + lanes <= end; k += lanes) sum += array.segment<lanes>(k).array();
    sums[begin / chunk] = sum.sum();
  });
  return sums.sum();
}

void triad(const Eigen::VectorXd& b, const Eigen::VectorXd& c, Eigen::VectorXd& a, int threads) {
  gradpsi::parallel_chunks(static_cast<int>(a.size()), 1 << 16, threads, [&](int begin, int end) {
    a.segment(begin, end - begin) =
        b.segment(begin, end - begin) + 3 * c.segment(begin, end - begin);
  });
}

class Report {
 public:
  Report(double entries, double bytes) : entries_(entries), bytes_(bytes) {
    std::printf("\n%-36s %12s %8s %8s\n", "", "ns an entry", "GB/s", "of roof");
  }
  /// The roof: what reading that many bytes takes.
  void roof(const char* name, double bytes, double seconds) {
    if (roof_ == 0) roof_ = bytes / seconds;
    std::printf("%-36s %12s %8.1f %7.0f%%\n", name, "", bytes / seconds / 1e9,
                100 * bytes / seconds / roof_);
  }
  /// A product of `count` vectors; `bytes` is what it has to read and write.
  void line(const char* name, double seconds, double bytes, int count = 1) const {
    std::printf("%-36s %12.3f %8.1f %7.0f%%\n", name, 1e9 * seconds / entries_ / count,
                bytes / seconds / 1e9, 100 * bytes / seconds / roof_);
  }
  double bytes() const { return bytes_; }

 private:
  double entries_, bytes_, roof_ = 0;
};

/// As much memory as the matrix takes, up to 2 GB: what fits a cache is compared with the cache.
void measure_roof(Report& report, int threads) {
  const auto doubles = static_cast<Eigen::Index>(std::min(report.bytes() / 8, double(1 << 28))) + 1;
  const Eigen::VectorXd array = Eigen::VectorXd::Constant(doubles, 1e-3);
  double sum = 0;
  report.roof("reading that many bytes (roof)", 8.0 * static_cast<double>(doubles),
              median_seconds([&] { sum += read_all(array, threads); }));
  Eigen::VectorXd a(doubles / 3 + 1), b = a.setOnes(), c = a;
  report.roof("triad, a = b + 3 c", 24.0 * static_cast<double>(a.size()),
              median_seconds([&] { triad(b, c, a, threads); }));
  if (!(sum > 0)) std::cout << ' ';  // so that the sums are needed
}

/// For the matrix, its copies by columns, of single precision and transposed, and ten vectors.
void check_memory(const path& file, double entries, double vectors) {
  const double needed = 60 * entries + 100 * vectors;
  const double memory = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * sysconf(_SC_PAGESIZE);
  if (needed > memory)
    throw gradpsi::InvalidInput(file.string() + ": products of a matrix of that size take about " +
                                std::to_string(std::llround(needed / 1e9)) + " GB, there are " +
                                std::to_string(std::llround(memory / 1e9)));
}

void run(const Given& given) {
  const SparseMatrix A = gradpsi::read_matrix_market(given.matrix);
  const int threads = given.threads;
  if (A.nonZeros() == 0) throw gradpsi::InvalidInput(given.matrix.string() + " has no entries");
  const auto rows = static_cast<double>(A.rows()), columns = static_cast<double>(A.cols());
  const auto entries = static_cast<double>(A.nonZeros());
  const double vectors = 8 * (rows + columns), pattern = 4 * entries + 4 * rows;
  check_memory(given.matrix, entries, rows + columns);
  const bool symmetric =
      A.rows() == A.cols() && gradpsi::summarise(A, Eigen::VectorXd::Ones(A.rows())).symmetric;
  std::printf("%s: %ld x %ld, %ld entries, %.1f a row%s\n", given.matrix.c_str(),
              static_cast<long>(A.rows()), static_cast<long>(A.cols()),
              static_cast<long>(A.nonZeros()), entries / rows, symmetric ? ", symmetric" : "");

  Report report(entries, 8 * entries + pattern + vectors);
  measure_roof(report, threads);
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(A.cols(), -1, 1);
  Eigen::VectorXd y(A.rows());
  const auto line = [&](const char* name, double bytes, const std::function<void()>& product,
                        int count = 1) {
    report.line(name, median_seconds(product), bytes, count);
  };
  Eigen::setNbThreads(gradpsi::checked_threads(threads));
  line("Eigen, row-major", report.bytes(), [&] { y.noalias() = A * x; });
  {
    const Eigen::SparseMatrix<double> by_columns = A;
    line("Eigen, column-major (one thread)", report.bytes(), [&] { y.noalias() = by_columns * x; });
  }
  line("gradpsi", report.bytes(), [&] { gradpsi::multiply(A, x, y, threads); });
  const Eigen::VectorXd ours = y;
  const gradpsi::SingleSparseMatrix single = A.cast<float>();
  line("gradpsi, values in single precision", report.bytes() - 4 * entries,
       [&] { gradpsi::multiply(single, x, y, threads); });
  const Eigen::MatrixXd X = x.replicate(1, 4);
  Eigen::MatrixXd Y;
  line(
      "gradpsi, four vectors, each", report.bytes() + 3 * vectors,
      [&] { gradpsi::multiply(A, X, Y, threads); }, 4);
  if (symmetric) {
    const SparseMatrix upper = A.triangularView<Eigen::Upper>();
    line("gradpsi, upper triangle only",
         12 * static_cast<double>(upper.nonZeros()) + 4 * rows + vectors,
         [&] { gradpsi::multiply_symmetric(upper, x, y, threads); });
  }
  const Eigen::VectorXd scale = A.cwiseAbs() * x.cwiseAbs();
  const double error = (ours - A * x).cwiseAbs().cwiseQuotient(scale.cwiseMax(1e-300)).maxCoeff();
  std::printf("\nlargest difference from Eigen's product, of sum |a| |x|: %.1e\n", error);
}

}  // namespace

std::function<void()> declare_spmv(Options& options) {
  auto given = std::make_shared<Given>();
  options.file("MATRIX", given->matrix, "FILE.mtx", "Matrix Market, coordinate").required();
  options.count("--threads", given->threads, thread_limits, "N", "0: as many as there are");
  options.examples("Example: gradpsi spmv laplacian.mtx --threads 1");
  return [given] { run(*given); };
}

}  // namespace gradpsi::apps
