// Products of several matrices and components, for every kind of processor that this machine can stand for.

#include "calculus/contract.hpp"

#include "clouds.hpp"

namespace gradpsi {
namespace {

class Contractions : public testing::TestWithParam<Cpu> {};

TEST_P(Contractions, SumTheirTermsOverRowsOfAnyLength) {
  constexpr int n = 40;
  std::vector<SparseMatrix> A;
  for (int m = 0; m < 6; ++m) {
    const Eigen::MatrixXd dense = Eigen::MatrixXd::Random(n, n);
    A.emplace_back(n, n);  // row i has i entries
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < i; ++j) A[m].insert(i, (7 * j) % n) = dense(i, (7 * j) % n);
    A[m].makeCompressed();
  }
  const Eigen::MatrixXd x = Eigen::MatrixXd::Random(n, 3);
  const ContractionKernels kernels = contraction_kernels(GetParam());
  for (int what = 0; what < vector_operator_count; ++what)
    for (int d = 1; d <= 3; ++d) {
      const Contraction& table = vector_operator_rows[what].by_dimension[d - 1];
      ASSERT_EQ(kernels.of[what][d - 1] == nullptr, table.results == 0);
      if (table.results == 0) continue;
      Eigen::MatrixXd y(n, 9), expected = Eigen::MatrixXd::Zero(n, 9);
      ContractionArguments arguments{A[0].outerIndexPtr(),
                                     A[0].innerIndexPtr(),
                                     static_cast<int>(A[0].nonZeros()),
                                     {},
                                     {},
                                     {}};
      for (int m = 0; m < 6; ++m) arguments.values[m] = A[m].valuePtr();
      for (int c = 0; c < 3; ++c) arguments.x[c] = x.col(c).data();
      for (int r = 0; r < 9; ++r) arguments.y[r] = y.col(r).data();
      for (int t = 0; t < table.count; ++t) {
        const Product& term = table.terms[t];
        expected.col(term.result) += term.factor * (A[term.matrix] * x.col(term.component));
      }
      kernels.of[what][d - 1](arguments, 0, n);
      EXPECT_LT((y - expected).leftCols(table.results).cwiseAbs().maxCoeff(), 1e-13)
          << vector_operator_rows[what].name << ' ' << d << 'd';
    }
}

INSTANTIATE_TEST_SUITE_P(Processors, Contractions,
                         testing::ValuesIn(std::vector<Cpu>(runnable_cpus().begin(),
                                                            runnable_cpus().end())),
                         [](const auto& the_case) { return std::string(the_case.param.name); });

}  // namespace
}  // namespace gradpsi
