// Operators on vectors: what they are exact on, and how they go together.

#include "calculus/fields.hpp"
#include "clouds.hpp"

namespace gradpsi {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using enum VectorOperator;

/// A cloud with jitter and unequal volumes in which every row of the scheme has an answer.
struct Points {
  Cloud cloud;
  Neighbours near;

  Points(int dimension, const Scheme& scheme)
      : cloud(irregular_cloud(dimension, dimension == 1   ? 30
                                         : dimension == 2 ? 12
                                                          : degree(scheme) + 4)),
        near(find_neighbours(cloud,
                             (support_ratio(scheme).value_or(2.4) + 0.5) * cloud.spacing())) {}
};

/// Largest entry of |found - expected| over what rounding makes of sums of that size.
double off(const Eigen::MatrixXd& found, const Eigen::MatrixXd& expected, double size) {
  EXPECT_EQ(found.rows(), expected.rows());
  EXPECT_EQ(found.cols(), expected.cols());
  EXPECT_GT(size, 0);
  return (found - expected).cwiseAbs().maxCoeff() / size;
}

/// The largest sum |a| |v| of a row.
double row_size(const std::vector<SparseMatrix>& parts, const Eigen::MatrixXd& v) {
  double size = 0;
  for (const SparseMatrix& A : parts)
    size = std::max(size, (A.cwiseAbs() * v.cwiseAbs()).maxCoeff());
  return size;
}

Eigen::MatrixXd value(VectorOperator what, const Operator& op, const Eigen::MatrixXd& v) {
  Eigen::MatrixXd Y;
  multiply(what, op.axes, v, Y);
  return Y;
}

bool has_curl_or_none(VectorOperator what, int d) { return !components(what, d).empty(); }

/// What an operator takes of a scalar or a vector.
Eigen::MatrixXd argument(VectorOperator what, const Eigen::MatrixXd& v) {
  return v.leftCols(what == Gradient ? 1 : v.cols());
}

// ---- Exact where their derivatives are

class VectorOperators : public testing::TestWithParam<SchemeAndDimension> {
 protected:
  const Scheme& scheme() const { return std::get<0>(GetParam()); }
  int dimension() const { return std::get<1>(GetParam()); }
};

TEST_P(VectorOperators, AreExactOnPolynomialsOfTheSchemesDegree) {
  const Points points(dimension(), scheme());
  const Operator op = assemble(scheme(), points.cloud, points.near);
  const bool hessian = order(scheme().derivative) == 2;
  for (const VectorOperator what : vector_operators()) {
    if ((what == GradDiv) != hessian || !has_curl_or_none(what, dimension())) continue;
    for (int p = 0; p <= degree(scheme()); ++p) {
      const PolynomialVector field(dimension(), p);
      const Positions& x = points.cloud.positions();
      const Eigen::MatrixXd v = field(x);
      // Rounding of rows whose systems have condition numbers up to 1e6.
      EXPECT_LT(
          off(value(what, op, argument(what, v)), exact(what, field, x), row_size(op.axes, v)),
          1e-9)
          << name(what) << ", degree " << p;
    }
  }
}

std::vector<Scheme> consistent(std::initializer_list<Derivative> derivatives) {
  std::vector<Scheme> chosen;
  for (const Scheme& scheme : schemes())
    if (std::ranges::find(derivatives, scheme.derivative) != derivatives.end() &&
        degree(scheme) >= 1 && degree(scheme) <= 4)
      chosen.push_back(scheme);
  return chosen;
}

INSTANTIATE_TEST_SUITE_P(Schemes, VectorOperators,
                         testing::Combine(testing::ValuesIn(consistent({Derivative::Gradient,
                                                                        Derivative::Hessian})),
                                          testing::Values(1, 2, 3)),
                         case_name);

class ViscousForce : public testing::TestWithParam<std::tuple<int, int>> {
 protected:
  int dimension() const { return std::get<0>(GetParam()); }
  int degree() const { return std::get<1>(GetParam()); }
  std::string scheme(const char* derivative) const {
    return derivative + std::string("-ls-") + std::to_string(degree());
  }
  Points points() const { return {dimension(), scheme("hessian")}; }
};

// d_b(mu (d_b v_a + d_a v_b)) by the product rule.
Eigen::MatrixXd exact_force(const Polynomial& mu, const PolynomialVector& v, const Positions& x) {
  const int d = v.dimension();
  Eigen::MatrixXd force = Eigen::MatrixXd::Zero(x.rows(), d);
  for (int a = 0; a < d; ++a)
    for (int b = 0; b < d; ++b)
      force.col(a) += mu.derivative(x, {b}).cwiseProduct(v.d(x, a, b) + v.d(x, b, a)) +
                      mu(x).cwiseProduct(v.dd(x, a, b, b) + v.dd(x, b, a, b));
  return force;
}

TEST_P(ViscousForce, IsExactWhereTheProductOfViscosityAndVelocityIs) {
  const auto [cloud, near] = points();
  const auto op = assemble({scheme("hessian"), scheme("gradient")}, cloud, near);
  const Positions& x = cloud.positions();
  for (int p = 0; p <= degree(); ++p) {
    const Polynomial mu(dimension(), p, 3);
    const double least = mu(x).minCoeff() - 1;  // a viscosity is not negative
    const Eigen::VectorXd viscosity = mu(x).array() - least;
    const PolynomialVector velocity(dimension(), degree() - p);
    const Eigen::MatrixXd v = velocity(x);
    const SparseMatrix force = viscous_force(op[0], op[1], viscosity);
    Eigen::MatrixXd expected = exact_force(mu, velocity, x);
    for (int a = 0; a < dimension(); ++a)
      for (int b = 0; b < dimension(); ++b)
        expected.col(a) -= least * (velocity.dd(x, a, b, b) + velocity.dd(x, b, a, b));
    const Eigen::VectorXd found = force * Eigen::VectorXd(v.reshaped());
    EXPECT_LT(off(found.reshaped(v.rows(), v.cols()), expected,
                  row_size(op[0].axes, v) * viscosity.maxCoeff()),
              1e-8)
        << "viscosity of degree " << p;
  }
}

TEST_P(ViscousForce, OfConstantViscosityIsLaplacianAndGradDiv) {
  const auto [cloud, near] = points();
  const auto op =
      assemble({scheme("hessian"), scheme("gradient"), scheme("laplacian")}, cloud, near);
  const Eigen::MatrixXd v = Eigen::MatrixXd::Random(cloud.size(), dimension());
  const SparseMatrix force =
      viscous_force(op[0], op[1], Eigen::VectorXd::Constant(cloud.size(), 3));
  const Eigen::VectorXd found = force * Eigen::VectorXd(v.reshaped());
  const Eigen::MatrixXd expected = 3 * (op[2].matrix() * v + value(GradDiv, op[0], v));
  EXPECT_LT(off(found.reshaped(v.rows(), v.cols()), expected, row_size(op[0].axes, v)), 1e-12);
}

TEST_P(ViscousForce, LeavesUniformMotionAlone) {
  const auto [cloud, near] = points();
  const auto op = assemble({scheme("hessian"), scheme("gradient")}, cloud, near);
  const Eigen::VectorXd mu = Eigen::VectorXd::Random(cloud.size()).array() + 1;
  const SparseMatrix force = viscous_force(op[0], op[1], mu);
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(force.cols());
  EXPECT_LT((force * ones).cwiseAbs().maxCoeff(), 1e-13 * (force.cwiseAbs() * ones).maxCoeff());
}

INSTANTIATE_TEST_SUITE_P(Degrees, ViscousForce,
                         testing::Combine(testing::Values(1, 2, 3), testing::Values(2, 3, 4)),
                         [](const auto& p) {
                           return std::to_string(std::get<0>(p.param)) + "d_degree_" +
                                  std::to_string(std::get<1>(p.param));
                         });

// ---- Two passes

TEST(TwoPasses, CurlGradAndDivCurlVanishOnPeriodicLatticesWhereTheMatricesCommute) {
  for (const int d : {2, 3}) {
    const Cloud cloud = periodic(make_cloud(Lattice{.dimension = d, .points_per_side = 9}));
    for (const char* scheme : {"gradient-direct-zoc", "gradient-direct-foc", "gradient-ls-2"}) {
      const Operator G = assemble(scheme, cloud, find_neighbours(cloud, 2.6 / 9));
      const SparseMatrix grad = block_matrix(Gradient, G.axes), curl = block_matrix(Curl, G.axes);
      const double size = grad.norm() * grad.norm() / cloud.size();
      EXPECT_LT(SparseMatrix(curl * grad).norm(), 1e-12 * size) << scheme;
      if (d == 2) continue;
      const SparseMatrix div = block_matrix(Divergence, G.axes);
      EXPECT_LT(SparseMatrix(div * curl).norm(), 1e-12 * size) << scheme;
    }
  }
}

TEST(TwoPasses, CurlGradAndDivCurlVanishOnPolynomials) {
  for (const int d : {2, 3}) {
    const auto [cloud, near] = Points(d, "gradient-ls-3");
    const Operator G = assemble("gradient-ls-3", cloud, near);
    const PolynomialVector field(d, 3);
    const Eigen::MatrixXd v = field(cloud.positions());
    const Eigen::MatrixXd slope = value(Gradient, G, v.leftCols(1));
    EXPECT_GT(slope.norm(), 1);
    EXPECT_LT(value(Curl, G, slope).cwiseAbs().maxCoeff(), 1e-9 * row_size(G.axes, slope));
    if (d == 2) continue;
    const Eigen::MatrixXd turn = value(Curl, G, v);
    EXPECT_GT(turn.norm(), 1);
    EXPECT_LT(value(Divergence, G, turn).cwiseAbs().maxCoeff(), 1e-9 * row_size(G.axes, turn));
  }
}

TEST(TwoPasses, AreProductsOfBlockMatrices) {
  for (const int d : {1, 2, 3}) {
    const auto [cloud, near] = Points(d, "gradient-ls-2");
    const Operator G = assemble("gradient-ls-2", cloud, near);
    const PolynomialVector field(d, 2);
    const Positions& x = cloud.positions();
    const SparseMatrix grad = block_matrix(Gradient, G.axes),
                       div = block_matrix(Divergence, G.axes);
    const Eigen::VectorXd v = field(x).reshaped(), u = field.components[0](x);
    Eigen::VectorXd laplacian = Eigen::VectorXd::Zero(x.rows());
    for (int a = 0; a < d; ++a) laplacian += field.dd(x, 0, a, a);
    const double size = (grad.cwiseAbs() * (div.cwiseAbs() * v.cwiseAbs())).maxCoeff();
    EXPECT_LT(off(SparseMatrix(div * grad) * u, laplacian, size), 1e-10);
    EXPECT_LT(off(SparseMatrix(grad * div) * v, exact(GradDiv, field, x).reshaped(), size), 1e-10);
  }
}

/// Root mean square of the error of grad div v away from the edges of a jittered square, v of sines.
template <class GradDivOf>
double grad_div_error(int side, const GradDivOf& grad_div) {
  const Cloud cloud = make_cloud(Lattice{.points_per_side = side, .jitter = 0.2});
  const Eigen::ArrayXd x = cloud.positions().col(0), y = cloud.positions().col(1);
  Eigen::MatrixXd v(cloud.size(), 2), exact(cloud.size(), 2);
  v << (3 * x + y).sin(), (2 * x - 3 * y + 0.5).cos();
  // div v = 3 cos(3x + y) + 3 sin(2x - 3y + 0.5)
  exact << -9 * (3 * x + y).sin() + 6 * (2 * x - 3 * y + 0.5).cos(),
      -3 * (3 * x + y).sin() - 9 * (2 * x - 3 * y + 0.5).cos();
  const Eigen::MatrixXd off =
      grad_div(cloud, find_neighbours(cloud, 3.5 * cloud.spacing()), v) - exact;
  const Eigen::ArrayXd inside =
      ((cloud.positions().array() - 0.5).abs() < 0.25).rowwise().all().cast<double>();
  return std::sqrt((inside * off.rowwise().squaredNorm().array()).sum() / inside.sum());
}

TEST(TwoPasses, OfASecondOrderGradientAreOfOrderTwoOfAHessianOneOfAFirstOrderGradientNone) {
  const auto order = [](const auto& grad_div) {
    return std::log2(grad_div_error(60, grad_div) / grad_div_error(240, grad_div)) / 2;
  };
  const auto passes = [](const char* scheme) {
    return [scheme](const Cloud& cloud, const Neighbours& near, const Eigen::MatrixXd& v) {
      const Operator G = assemble(scheme, cloud, near);
      return value(Gradient, G, value(Divergence, G, v));
    };
  };
  const auto hessian = [](const Cloud& cloud, const Neighbours& near, const Eigen::MatrixXd& v) {
    return value(GradDiv, assemble("hessian-ls-2", cloud, near), v);
  };
  EXPECT_NEAR(order(passes("gradient-ls-2")), 2, 0.25);
  EXPECT_NEAR(order(hessian), 1.15, 0.15);
  EXPECT_LT(order(passes("gradient-direct-foc")), 0.5);
}

// ---- Two forms of one operator

struct Pair {
  Operator gradient, hessian;
  const Operator& of(VectorOperator what) const { return what == GradDiv ? hessian : gradient; }
};

Pair operators(int d, int points_per_side, const AssemblyOptions& options = {}) {
  const Cloud cloud = irregular_cloud(d, points_per_side);
  auto both = assemble({"gradient-ls-2", "hessian-ls-2"}, cloud,
                       find_neighbours(cloud, rich_support(cloud)), options);
  return {both[0], both[1]};
}

// The matrices that components() tells of, one by one with Eigen's products.
Eigen::MatrixXd by_the_letter(VectorOperator what, const Operator& op, const Eigen::MatrixXd& v) {
  const auto d = v.cols();
  const auto& A = op.axes;
  if (what == Gradient) {
    Eigen::MatrixXd result(A[0].rows(), A.size());
    for (std::size_t a = 0; a < A.size(); ++a) result.col(static_cast<int>(a)) = A[a] * v;
    return result;
  }
  if (what == Divergence) {
    Eigen::MatrixXd sum = A[0] * v.col(0);
    for (int a = 1; a < d; ++a) sum += A[a] * v.col(a);
    return sum;
  }
  if (what == Curl && d == 2) return A[0] * v.col(1) - A[1] * v.col(0);
  Eigen::MatrixXd result =
      Eigen::MatrixXd::Zero(A[0].rows(), std::ssize(components(what, static_cast<int>(d))));
  int column = 0;
  for (int a = 0; a < d; ++a) {
    const int b = (a + 1) % 3, c = (a + 2) % 3;
    if (what == Curl) result.col(a) = A[b] * v.col(c) - A[c] * v.col(b);
    for (int e = 0; what == VelocityGradient && e < d; ++e) result.col(column++) = A[e] * v.col(a);
    for (int e = a; what == Strain && e < d; ++e)
      result.col(column++) = (A[e] * v.col(a) + A[a] * v.col(e)) / 2;
    for (int e = a; what == GradDiv && e < d; ++e, ++column) {  // H_ae, column counts them
      result.col(a) += A[column] * v.col(e);
      if (e != a) result.col(e) += A[column] * v.col(a);
    }
  }
  return result;
}

TEST(VectorProducts, AreTheLetterAndTheBlockMatrix) {
  for (const int d : {1, 2, 3}) {
    const Pair pair = operators(d, d == 1 ? 30 : d == 2 ? 11 : 6);
    const Eigen::MatrixXd random = Eigen::MatrixXd::Random(pair.gradient.matrix().cols(), d);
    for (const VectorOperator what : vector_operators()) {
      if (!has_curl_or_none(what, d)) continue;
      const Operator& op = pair.of(what);
      const Eigen::MatrixXd v = argument(what, random);
      const Eigen::MatrixXd found = value(what, op, v);
      const double size = row_size(op.axes, v);
      EXPECT_LT(off(found, by_the_letter(what, op, v), size), 1e-14) << name(what) << d;
      const SparseMatrix blocks = block_matrix(what, op.axes);
      EXPECT_TRUE(blocks.isCompressed());
      const Eigen::VectorXd stacked = blocks * Eigen::VectorXd(v.reshaped());
      EXPECT_LT(off(stacked, found.reshaped(), size), 1e-14) << name(what) << d;
      for (int i = 0; i < blocks.rows(); ++i)
        for (int k = blocks.outerIndexPtr()[i] + 1; k < blocks.outerIndexPtr()[i + 1]; ++k)
          ASSERT_LT(blocks.innerIndexPtr()[k - 1], blocks.innerIndexPtr()[k]);
    }
  }
}

TEST(VectorProducts, OfSomeRowsAreThoseRows) {
  const std::vector<int> rows = {7, 3, 20};
  const Pair all = operators(2, 8), some = operators(2, 8, {.rows = rows});
  const Eigen::MatrixXd v = Eigen::MatrixXd::Random(64, 2);
  for (const VectorOperator what : vector_operators()) {
    const Eigen::MatrixXd u = argument(what, v);
    const Eigen::MatrixXd expected = value(what, all.of(what), u)(rows, Eigen::all);
    EXPECT_LT(off(value(what, some.of(what), u), expected, expected.norm()), 1e-13) << name(what);
    const Eigen::VectorXd stacked =
        block_matrix(what, some.of(what).axes) * Eigen::VectorXd(u.reshaped());
    EXPECT_LT(off(stacked, value(what, some.of(what), u).reshaped(), stacked.norm()), 1e-13);
  }
  const Eigen::VectorXd mu = v.col(0).array() + 2;
  const Eigen::MatrixXd whole = viscous_force(all.hessian, all.gradient, mu),
                        part = viscous_force(some.hessian, some.gradient, mu);
  for (int k = 0; k < 3; ++k)
    for (const int a : {0, 1})
      EXPECT_LT((part.row(3 * a + k) - whole.row(64 * a + rows[k])).norm(), 1e-12 * whole.norm());
}

TEST(VectorProducts, DoNotDependOnTheNumberOfThreads) {
  for (const int d : {2, 3}) {
    const Pair pair = operators(d, d == 2 ? 90 : 15);  // several parts
    const Eigen::MatrixXd random = Eigen::MatrixXd::Random(pair.gradient.matrix().cols(), d);
    const Eigen::VectorXd mu = random.col(0).array() + 1;
    const auto equal = [](const SparseMatrix& A, const SparseMatrix& B) {
      return A.nonZeros() == B.nonZeros() && A.coeffs().isApprox(B.coeffs(), 0) &&
             std::equal(A.innerIndexPtr(), A.innerIndexPtr() + A.nonZeros(), B.innerIndexPtr());
    };
    for (const int threads : {2, 5}) {
      for (const VectorOperator what : vector_operators()) {
        const auto& parts = pair.of(what).axes;
        const Eigen::MatrixXd v = argument(what, random);
        Eigen::MatrixXd one, many;
        multiply(what, parts, v, one, 1), multiply(what, parts, v, many, threads);
        EXPECT_EQ(one, many) << name(what);
        EXPECT_TRUE(equal(block_matrix(what, parts, 1), block_matrix(what, parts, threads)));
      }
      EXPECT_TRUE(equal(viscous_force(pair.hessian, pair.gradient, mu, 1),
                        viscous_force(pair.hessian, pair.gradient, mu, threads)));
      EXPECT_TRUE(equal(conservative_companion(pair.gradient, 1)[1],
                        conservative_companion(pair.gradient, threads)[1]));
    }
  }
}

TEST(VectorProducts, AreNamedInTheOrderOfTheirNumbers) {
  EXPECT_THAT(components(Gradient, 1), ElementsAre("x"));
  EXPECT_THAT(components(Divergence, 3), ElementsAre(""));
  EXPECT_THAT(components(Curl, 1), ElementsAre());
  EXPECT_THAT(components(Curl, 2), ElementsAre(""));
  EXPECT_THAT(components(Curl, 3), ElementsAre("x", "y", "z"));
  EXPECT_THAT(components(VelocityGradient, 2), ElementsAre("xx", "xy", "yx", "yy"));
  EXPECT_THAT(components(Strain, 1), ElementsAre("xx"));
  EXPECT_THAT(components(Strain, 3), ElementsAre("xx", "xy", "xz", "yy", "yz", "zz"));
  EXPECT_THAT(components(GradDiv, 2), ElementsAre("x", "y"));
  std::string names;
  for (const VectorOperator what : vector_operators()) names += std::string(name(what)) + ' ';
  EXPECT_EQ(names, "gradient divergence curl velocity-gradient strain grad-div ");
}

TEST(VectorProducts, ArgumentsThatDoNotFitAreRefused) {
  const Pair pair = operators(2, 6);
  const auto& G = pair.gradient.axes;
  const Eigen::MatrixXd v = Eigen::MatrixXd::Random(36, 2);
  const auto refusal = [](VectorOperator what, std::span<const SparseMatrix> parts,
                          const Eigen::MatrixXd& x, int threads = 0) {
    return message_of<InvalidInput>([&] {
      Eigen::MatrixXd Y;
      multiply(what, parts, x, Y, threads);
    });
  };
  EXPECT_THAT(refusal(Divergence, G, v.leftCols(1)),
              HasSubstr("the divergence in 2D takes fields of 2 components, not 1"));
  EXPECT_THAT(refusal(Gradient, G, v), HasSubstr("takes fields of 1 components, not 2"));
  EXPECT_THAT(refusal(GradDiv, G, v), HasSubstr("the grad-div takes 1, 3 or 6 matrices, not 2"));
  EXPECT_THAT(refusal(Curl, std::span(G).first(1), v.leftCols(1)),
              HasSubstr("the curl takes 2 or 3 matrices, not 1"));
  EXPECT_THAT(refusal(Divergence, {}, v), HasSubstr("takes 1, 2 or 3 matrices, not 0"));
  EXPECT_THAT(refusal(Divergence, G, v.topRows(30)), HasSubstr("has 30 entries for 36 columns"));
  EXPECT_THAT(refusal(Divergence, G, v, -1), HasSubstr("threads"));
  SparseMatrix other = G[0];
  other.prune([](int, int column, double) { return column != 5; });
  EXPECT_THAT(refusal(Divergence, std::array{G[0], other}, v), HasSubstr("do not share"));
  Eigen::MatrixXd over = v;
  EXPECT_THAT(message_of<InvalidInput>([&] { multiply(Curl, G, over, over); }),
              HasSubstr("written over its argument"));
  EXPECT_THROW(block_matrix(Divergence, std::array{G[0], other}), InvalidInput);
  EXPECT_THROW(components(Curl, 4), InvalidInput);
}

TEST(ViscousForces, ArgumentsThatDoNotFitAreRefused) {
  const Pair pair = operators(2, 6);
  Eigen::VectorXd mu = Eigen::VectorXd::Ones(36);
  const auto refusal = [&](const Operator& hessian, const Operator& gradient) {
    return message_of<InvalidInput>([&] { viscous_force(hessian, gradient, mu); });
  };
  EXPECT_THAT(refusal(pair.gradient, pair.gradient), HasSubstr("not 2 and 2"));
  EXPECT_THAT(refusal(pair.hessian, operators(2, 6, {.rows = std::vector<int>{1}}).gradient),
              HasSubstr("do not share their rows"));
  mu[4] = -1;
  EXPECT_THAT(refusal(pair.hessian, pair.gradient),
              HasSubstr("the viscosity at point 4 must be >= 0 and finite, not -1"));
  mu.conservativeResize(3);
  EXPECT_THAT(refusal(pair.hessian, pair.gradient), HasSubstr("3 viscosities for 36 points"));
}

}  // namespace
}  // namespace gradpsi
