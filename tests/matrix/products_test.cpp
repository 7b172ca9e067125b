// Products, for every kind of processor that this machine can stand for.

#include "matrix/products.hpp"

#include "clouds.hpp"

namespace gradpsi {
namespace {

class VectorProducts : public testing::TestWithParam<Cpu> {
 protected:
  const Cpu& code() const { return GetParam(); }
};

TEST_P(VectorProducts, MultipliesRowsOfAnyLength) {
  constexpr int n = 40;
  const Eigen::MatrixXd dense = Eigen::MatrixXd::Random(n, n);
  SparseMatrix A(n, n);  // row i has i entries
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j) A.insert(i, (7 * j) % n) = dense(i, (7 * j) % n);
  A.makeCompressed();
  const SparseMatrix B = 2 * A, C = A.cwiseProduct(A);
  const Eigen::SparseMatrix<float, Eigen::RowMajor> single = A.cast<float>();
  const auto entries = static_cast<int>(A.nonZeros());
  const Eigen::MatrixXd x = Eigen::MatrixXd::Random(n, 4);
  Eigen::MatrixXd y(n, 4);
  const auto near = [&](const Eigen::MatrixXd& result, const Eigen::MatrixXd& expected) {
    return (result - expected).cwiseAbs().maxCoeff() < 1e-13;
  };
  for (int vectors = 1; vectors <= 4; ++vectors) {
    ProductArguments<double> arguments{
        A.outerIndexPtr(), A.innerIndexPtr(), entries, {A.valuePtr()}, {}, {}};
    for (int v = 0; v < vectors; ++v)
      arguments.x[v] = x.col(v).data(), arguments.y[v] = y.col(v).data();
    product_kernels(code()).vectors[vectors - 1](arguments, 0, n);
    EXPECT_TRUE(near(y.leftCols(vectors), A * x.leftCols(vectors)));
  }
  for (int matrices = 1; matrices <= 3; ++matrices) {
    product_kernels(code()).matrices[matrices - 1](
        {A.outerIndexPtr(),
         A.innerIndexPtr(),
         entries,
         {A.valuePtr(), B.valuePtr(), C.valuePtr()},
         {x.data()},
         {y.col(0).data(), y.col(1).data(), y.col(2).data()}},
        0, n);
    const SparseMatrix* all[] = {&A, &B, &C};
    for (int m = 0; m < matrices; ++m) EXPECT_TRUE(near(y.col(m), *all[m] * x.col(0)));
  }
  product_kernels(code()).single({single.outerIndexPtr(),
                                  single.innerIndexPtr(),
                                  entries,
                                  {single.valuePtr()},
                                  {x.data()},
                                  {y.data()}},
                                 0, n);
  EXPECT_TRUE(near(y.col(0), single.cast<double>() * x.col(0)));
}

INSTANTIATE_TEST_SUITE_P(Processors, VectorProducts,
                         testing::ValuesIn(std::vector<Cpu>(runnable_cpus().begin(),
                                                            runnable_cpus().end())),
                         [](const auto& the_case) { return std::string(the_case.param.name); });

}  // namespace
}  // namespace gradpsi
