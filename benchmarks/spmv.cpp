// Products with the matrices, and the same sums without a matrix.

#include <array>
#include <cmath>

#include "parallel.hpp"
#include "sell.hpp"
#include "suite.hpp"

namespace {

using benchmark::State;
using Eigen::VectorXd;
using gradpsi::SparseMatrix;

VectorXd argument(const Prepared& scene) {
  VectorXd x(scene.cloud.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = std::sin(0.37 * static_cast<double>(i));
  return x;
}

/// x and A x, for the matrix of products.
struct Reference {
  VectorXd x, y;
};
const Reference& reference(Prepared& p) {
  return p.reference.get("laplacian", [&] {
    Reference r{argument(p), {}};
    r.y.noalias() = p.laplacian() * r.x;
    return r;
  });
}

template <class Matrix>
double bytes(const Matrix& A, double vectors = 2) {
  using Index = typename Matrix::StorageIndex;
  return static_cast<double>(A.nonZeros() * (sizeof(typename Matrix::Scalar) + sizeof(Index)) +
                             (A.rows() + 1) * sizeof(Index)) +
         8 * vectors * static_cast<double>(A.rows());
}

/// The copy has large pages as the library's matrices do, or products would differ for that reason.
template <class Matrix, class Other>
Matrix in_large_pages(const Other& other) {
  const Matrix converted = other;
  Matrix copy(converted.rows(), converted.cols());
  copy.resizeNonZeros(converted.nonZeros());
  prefer_large_pages(copy.valuePtr(), sizeof(*copy.valuePtr()) * copy.nonZeros());
  prefer_large_pages(copy.innerIndexPtr(), sizeof(*copy.innerIndexPtr()) * copy.nonZeros());
  std::copy_n(converted.outerIndexPtr(), converted.outerSize() + 1, copy.outerIndexPtr());
  std::copy_n(converted.innerIndexPtr(), converted.nonZeros(), copy.innerIndexPtr());
  std::copy_n(converted.valuePtr(), converted.nonZeros(), copy.valuePtr());
  return copy;
}

bool is_wrong(const VectorXd& y, const VectorXd& expected, double tolerance = 1e-12) {
  return !((y - expected).lpNorm<Eigen::Infinity>() <=
           tolerance * expected.lpNorm<Eigen::Infinity>());
}

/// Times product(x, y), after having looked whether y is right.
template <class Product>
void time_product(State& state, Prepared& p, double bytes, const Product& product,
                  double tolerance = 1e-12) {
  const auto& [x, expected] = reference(p);
  VectorXd y(x.size());
  product(x, y);
  if (is_wrong(y, expected, tolerance)) return state.SkipWithError("wrong product");
  for (auto _ : state) {
    product(x, y);
    benchmark::DoNotOptimize(y.data());
    benchmark::ClobberMemory();
  }
  // Entries are those of the whole matrix, however they are stored, so that times compare.
  count(state, p, {.entries = static_cast<double>(p.laplacian().nonZeros()), .bytes = bytes});
}

void eigen(State& state, Prepared& p, int) {
  const SparseMatrix& A = p.laplacian();
  time_product(state, p, bytes(A), [&](const VectorXd& x, VectorXd& y) { y.noalias() = A * x; });
}

/// Eigen's product with a copy of another type.
template <class Matrix>
void eigen_as(State& state, Prepared& p, const char* key) {
  const Matrix& A = p.derived.get(key, [&] { return in_large_pages<Matrix>(p.laplacian()); });
  time_product(state, p, bytes(A), [&](const VectorXd& x, VectorXd& y) { y.noalias() = A * x; });
}
using ByColumns = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;
using LongIndices = Eigen::SparseMatrix<double, Eigen::RowMajor, std::int64_t>;

void ours(State& state, Prepared& p, int threads) {
  const SparseMatrix& A = p.laplacian();
  time_product(state, p, bytes(A),
               [&](const VectorXd& x, VectorXd& y) { gradpsi::multiply(A, x, y, threads); });
}

void single(State& state, Prepared& p, int threads) {
  using Single = gradpsi::SingleSparseMatrix;
  const Single& A =
      p.derived.get("single", [&] { return in_large_pages<Single>(p.laplacian().cast<float>()); });
  time_product(
      state, p, bytes(A),
      [&](const VectorXd& x, VectorXd& y) { gradpsi::multiply(A, x, y, threads); }, 1e-6);
}

void symmetric(State& state, Prepared& p, int threads) {
  const SparseMatrix& upper = p.derived.get("upper", [&] {
    return in_large_pages<SparseMatrix>(p.laplacian().triangularView<Eigen::Upper>());
  });
  time_product(state, p, bytes(upper), [&](const VectorXd& x, VectorXd& y) {
    gradpsi::multiply_symmetric(upper, x, y, threads);
  });
}

void four(State& state, Prepared& p, int threads) {
  const SparseMatrix& A = p.laplacian();
  const Eigen::MatrixXd X = argument(p).replicate(1, 4);
  Eigen::MatrixXd Y;
  gradpsi::multiply(A, X, Y, threads);
  if (is_wrong(Y.col(3), reference(p).y)) return state.SkipWithError("wrong product");
  for (auto _ : state) {
    gradpsi::multiply(A, X, Y, threads);
    benchmark::DoNotOptimize(Y.data());
    benchmark::ClobberMemory();
  }
  count(state, p, {.entries = 4.0 * static_cast<double>(A.nonZeros()), .bytes = bytes(A, 8)});
}

void sell(State& state, Prepared& p, int threads) {
  const Sell& A = p.derived.get("sell", [&] { return Sell(p.laplacian(), 0); });
  // Padding is not among what must be read.
  time_product(state, p, bytes(p.laplacian()),
               [&](const VectorXd& x, VectorXd& y) { A.multiply(x, y, threads); });
}

void convert_to_sell(State& state, Prepared& p, int threads) {
  const SparseMatrix& A = p.laplacian();
  for (auto _ : state) {
    const Sell converted(A, threads);
    benchmark::DoNotOptimize(&converted);
  }
  count(state, p, {.entries = static_cast<double>(A.nonZeros()), .bytes = 2 * bytes(A, 0)});
}

/// Times product(axes, x, Y), Y's columns being the derivatives.
template <class Product>
void time_gradient(State& state, Prepared& p, bool one_pattern, const Product& product) {
  const auto& axes = p.assembled("gradient-direct-foc").axes;
  const VectorXd x = argument(p);
  Eigen::MatrixXd Y(x.size(), std::ssize(axes));
  for (auto _ : state) {
    product(axes, x, Y);
    benchmark::DoNotOptimize(Y.data());
    benchmark::ClobberMemory();
  }
  const auto d = static_cast<double>(axes.size()),
             entries = static_cast<double>(axes[0].nonZeros());
  const auto n = static_cast<double>(x.size()), patterns = one_pattern ? 1 : d;
  count(state, p,
        {.entries = entries,
         .bytes = 8 * d * entries + patterns * 4 * (entries + n + 1) + 8 * (patterns + d) * n});
}

/// An operator on vectors in one pass over the matrices of a gradient.
void vectors_fused(State& state, Prepared& p, gradpsi::VectorOperator what, int threads) {
  const auto& axes = p.assembled("gradient-direct-foc").axes;
  const Eigen::MatrixXd v = argument(p).replicate(1, std::ssize(axes));
  Eigen::MatrixXd Y;
  gradpsi::multiply(what, axes, v, Y, threads);
  for (auto _ : state) {
    gradpsi::multiply(what, axes, v, Y, threads);
    benchmark::DoNotOptimize(Y.data());
    benchmark::ClobberMemory();
  }
  const auto entries = static_cast<double>(axes[0].nonZeros()), n = static_cast<double>(v.rows()),
             d = static_cast<double>(axes.size());
  count(
      state, p,
      {.entries = entries,
       .bytes = (8 * d + 4) * entries + 4 * (n + 1) + 8 * n * (d + static_cast<double>(Y.cols()))});
}

/// The same as one product a term, of those that its block matrix has.
void vectors_separate(State& state, Prepared& p, gradpsi::VectorOperator what, int threads) {
  const auto& axes = p.assembled("gradient-direct-foc").axes;
  const auto d = static_cast<int>(axes.size());
  const VectorXd v = argument(p);
  VectorXd part, sum;
  const int results = static_cast<int>(components(what, d).size());
  for (auto _ : state) {
    for (int r = 0; r < results; ++r) {
      // A divergence sums d products, a component of a curl two; a velocity gradient has one for each.
      const int terms = what == gradpsi::VectorOperator::Divergence ? d
                        : what == gradpsi::VectorOperator::Curl     ? 2
                                                                    : 1;
      gradpsi::multiply(axes[r % d], v, sum, threads);
      for (int t = 1; t < terms; ++t) {
        gradpsi::multiply(axes[(r + t) % d], v, part, threads);
        sum += part;
      }
    }
    benchmark::DoNotOptimize(sum.data());
    benchmark::ClobberMemory();
  }
  count(state, p, {.entries = static_cast<double>(axes[0].nonZeros())});
}

/// The points as the loop without a matrix wants them.
struct Arrays {
  std::array<VectorXd, 3> x;
  OnTheFly points;
};
Arrays arrays(const Prepared& p) {
  const int d = p.cloud.dimension();
  const double h = p.near.support(0), s = gradpsi::kernels().front().normalisation[d - 1];
  Arrays result;
  for (int a = 0; a < d; ++a) result.x[a] = p.cloud.positions().col(a);
  // -2 W'/r, W being s w(r/h) / h^d, and w'(q)/q = -20 (1 - q)^3.
  result.points = {.dimension = d,
                   .offsets = p.near.offsets.data(),
                   .indices = p.near.indices.data(),
                   .x = {result.x[0].data(), result.x[1].data(), result.x[2].data()},
                   .volumes = p.cloud.volumes().data(),
                   .support = h,
                   .factor = 40 * s / std::pow(h, d + 2)};
  return result;
}

void on_the_fly(State& state, Prepared& p, int threads) {
  const Arrays points = arrays(p);
  const auto n = static_cast<double>(p.cloud.size());
  const double bytes =
      4 * (static_cast<double>(p.near.indices.size()) + n) + 8 * n * (p.cloud.dimension() + 3);
  time_product(
      state, p, bytes,
      [&](const VectorXd& x, VectorXd& y) {
        parallel_chunks(static_cast<int>(x.size()), 4096, threads, [&](int begin, int end) {
          laplacian(points.points, begin, end, x.data(), y.data());
        });
      },
      1e-10);
}

}  // namespace

void add_products(const Scene& scene, Products products) {
  add("op:spmv/impl:eigen", scene, eigen);
  if (products == Products::All) {
    const auto by_columns = [](State& state, Prepared& p, int) {
      eigen_as<ByColumns>(state, p, "colmajor");
    };
    add("op:spmv/impl:eigen-colmajor", scene, by_columns, {1});  // which Eigen does with one thread
    add("op:spmv/impl:eigen-int64", scene,
        [](State& state, Prepared& p, int) { eigen_as<LongIndices>(state, p, "int64"); });
  }
  add("op:spmv/impl:gradpsi", scene, ours);
  if (products == Products::Main) return;
  add("op:spmv/impl:gradpsi-single", scene, single);
  add("op:spmv/impl:gradpsi-symmetric", scene, symmetric);
  add("op:spmv/impl:gradpsi-4rhs", scene, four);
  add("op:spmv/impl:sell", scene, sell);
  if (products == Products::All) add("op:convert/impl:sell", scene, convert_to_sell);
}

void add_gradient_products(const Scene& scene) {
  using Axes = std::vector<SparseMatrix>;
  const std::string scheme = "/scheme:gradient-direct-foc";
  add("op:gradient/impl:gradpsi-fused" + scheme, scene, [](State& state, Prepared& p, int threads) {
    time_gradient(state, p, true, [=](const Axes& axes, const VectorXd& x, Eigen::MatrixXd& Y) {
      gradpsi::multiply(axes, x, Y, threads);
    });
  });
  add("op:gradient/impl:gradpsi-separate" + scheme, scene,
      [](State& state, Prepared& p, int threads) {
        std::array<VectorXd, 3> y;  // vectors of their own, as this product wants
        time_gradient(state, p, false, [&](const Axes& axes, const VectorXd& x, Eigen::MatrixXd&) {
          for (int a = 0; a < std::ssize(axes); ++a) gradpsi::multiply(axes[a], x, y[a], threads);
        });
      });
  add("op:gradient/impl:eigen-separate" + scheme, scene, [](State& state, Prepared& p, int) {
    time_gradient(state, p, false, [](const Axes& axes, const VectorXd& x, Eigen::MatrixXd& Y) {
      for (int a = 0; a < std::ssize(axes); ++a) Y.col(a).noalias() = axes[a] * x;
    });
  });
}

void add_vector_products(const Scene& scene) {
  using enum gradpsi::VectorOperator;
  for (const auto what : {Divergence, Curl, VelocityGradient}) {
    const std::string op = "op:" + std::string(name(what)) + "/impl:gradpsi-";
    const std::string scheme = "/scheme:gradient-direct-foc";
    add(op + "fused" + scheme, scene,
        [what](State& state, Prepared& p, int threads) { vectors_fused(state, p, what, threads); });
    add(op + "separate" + scheme, scene, [what](State& state, Prepared& p, int threads) {
      vectors_separate(state, p, what, threads);
    });
  }
}

void add_on_the_fly(const Scene& scene) {
  add("op:onthefly/impl:loop/scheme:laplacian-mixed-zoc", scene, on_the_fly);
}
