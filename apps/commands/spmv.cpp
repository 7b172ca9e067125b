// gradpsi spmv: how fast a matrix of a file is multiplied, by which means, beside the memory's own speed.

#include "studies/spmv.hpp"

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <gradpsi/gradpsi.hpp>
#include <iostream>
#include <memory>

#include "commands.hpp"
#include "common/columns.hpp"

namespace gradpsi::apps {

namespace {

using spmv::Measurement;
using std::filesystem::path;

struct Given {
  path matrix;
  int threads = 0;
};

/// For the matrix, its copies by columns, of single precision and transposed, and ten vectors.
void check_memory(const path& file, double entries, double vectors) {
  const double needed = 60 * entries + 100 * vectors;
  const double memory = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * sysconf(_SC_PAGESIZE);
  if (needed > memory)
    throw InvalidInput(file.string() + ": products of a matrix of that size take about " +
                       std::to_string(std::llround(needed / 1e9)) + " GB, there are " +
                       std::to_string(std::llround(memory / 1e9)));
}

void run(const Given& given) {
  const SparseMatrix A = read_matrix_market(given.matrix);
  if (A.nonZeros() == 0) throw InvalidInput(given.matrix.string() + " has no entries");
  const auto rows = static_cast<double>(A.rows()), entries = static_cast<double>(A.nonZeros());
  check_memory(given.matrix, entries, rows + static_cast<double>(A.cols()));
  const bool symmetric =
      A.rows() == A.cols() && summarise(A, Eigen::VectorXd::Ones(A.rows())).symmetric;
  std::cout << given.matrix.string() << ": " << A.rows() << " x " << A.cols() << ", "
            << A.nonZeros() << " entries, " << cell(entries / rows, "%.1f") << " a row"
            << (symmetric ? ", symmetric" : "") << '\n';

  const Columns<Measurement> columns = {
      {"", &Measurement::what, {.width = -36}},
      {"ns an entry", &Measurement::ns_an_entry, {"%.3f", 13}},
      {"GB/s", [](auto& m) { return m.bytes_a_second / 1e9; }, {"%.1f", 9}},
      {"of roof", [](auto& m) { return 100 * share(m); }, {"%.0f%%", 9}}};
  std::cout << '\n' << text_heading(columns);
  Timer timer;
  bool above = false;
  const double difference =
      spmv::measure(A, symmetric, given.threads, timer, [&](const Measurement& m) {
        std::cout << text_lines(columns, {m}) << std::flush;
        above |= std::isnan(share(m));
      });
  if (above)
    std::cout << "Without a share: faster than the roof was, as what is in a cache, or a machine "
                 "that was\n"
                 "busy while that was measured\n";
  std::cerr << timer.warning();
  std::cout << "\nlargest difference from Eigen's product, of sum |a| |x|: "
            << cell(difference, "%.1e") << '\n';
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
