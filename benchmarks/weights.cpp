// From neighbours to matrices: weights, other weights in the same storage, several schemes in one pass.

#include "suite.hpp"

namespace {

using gradpsi::Operator;
using gradpsi::SparseMatrix;

double entries(const std::vector<Operator>& operators) {
  double sum = 0;
  for (const Operator& op : operators)
    for (const SparseMatrix& A : op.axes) sum += static_cast<double>(A.nonZeros());
  return sum;
}

/// `per_entry` bytes are written for every entry of every matrix; points and neighbours are read.
void count_weights(benchmark::State& state, const Prepared& scene, double entries,
                   double per_entry) {
  const auto n = static_cast<double>(scene.cloud.size());
  const auto neighbours = static_cast<double>(scene.near.indices.size());
  count(state, scene,
        {.entries = neighbours,
         .bytes =
             per_entry * entries + 4 * (n + neighbours) + 8 * n * (scene.cloud.dimension() + 1)});
}

const std::vector<gradpsi::Scheme> pair = {"gradient-ls-2", "laplacian-ls-2"};
const std::string pair_name = "/scheme:gradient-ls-2+laplacian-ls-2";

std::vector<Operator> one_after_the_other(const Prepared& p, int threads) {
  std::vector<Operator> all;
  for (const auto& scheme : pair)
    all.push_back(assemble(scheme, p.cloud, p.near, assembly_options(threads)));
  return all;
}

SparseMatrix from_triplets(const SparseMatrix& A) {
  std::vector<Eigen::Triplet<double>> triplets;
  triplets.reserve(A.nonZeros());
  for (int i = 0; i < A.rows(); ++i)
    for (SparseMatrix::InnerIterator a(A, i); a; ++a) triplets.emplace_back(i, a.col(), a.value());
  SparseMatrix result(A.rows(), A.cols());
  result.setFromTriplets(triplets.begin(), triplets.end());
  return result;
}

SparseMatrix copied(const SparseMatrix& A) {
  SparseMatrix result(A.rows(), A.cols());
  result.resizeNonZeros(A.nonZeros());
  std::copy_n(A.outerIndexPtr(), A.rows() + 1, result.outerIndexPtr());
  std::copy_n(A.innerIndexPtr(), A.nonZeros(), result.innerIndexPtr());
  std::copy_n(A.valuePtr(), A.nonZeros(), result.valuePtr());
  return result;
}

template <class Fill>
void add_fill_by(const std::string& impl, const Scene& scene, const Fill& fill) {
  const std::string scheme = "laplacian-mixed-soc";
  add("op:fill/impl:" + impl + "/scheme:" + scheme, scene,
      [=](benchmark::State& state, Prepared& p, int) {
        const SparseMatrix& A = p.assembled(scheme).matrix();
        for (auto _ : state) benchmark::DoNotOptimize(fill(A));
        const auto all = static_cast<double>(A.nonZeros());
        count(state, p, {.entries = all, .bytes = 2 * (12 * all + 4.0 * p.cloud.size())});
      },
      {1});
}

}  // namespace

void add_weights(const std::string& scheme, const Scene& scene) {
  add("op:weights/impl:gradpsi/scheme:" + scheme, scene,
      [=](benchmark::State& state, Prepared& p, int threads) {
        double made = 0;
        for (auto _ : state) {
          const std::vector<Operator> result = assemble(std::vector<gradpsi::Scheme>{scheme},
                                                        p.cloud, p.near, assembly_options(threads));
          made = entries(result);
        }
        count_weights(state, p, made, 12);
      });
}

void add_refill(const std::string& scheme, const Scene& scene) {
  add("op:refill/impl:gradpsi/scheme:" + scheme, scene,
      [=](benchmark::State& state, Prepared& p, int threads) {
        Operator& op = p.assembled(scheme);
        for (auto _ : state) {
          reassemble(scheme, p.cloud, p.near, op, assembly_options(threads));
          benchmark::ClobberMemory();
        }
        double all = 0;
        for (const SparseMatrix& A : op.axes) all += static_cast<double>(A.nonZeros());
        count_weights(state, p, all, 8);
      });
}

void add_forms(const Scene& scene) {
  const std::vector<std::pair<std::string, std::vector<gradpsi::Scheme>>> forms = {
      {"gradient-ls-2", {"gradient-ls-2"}},
      {"laplacian-ls-2", {"laplacian-ls-2"}},
      {"gradient-mls-2", {"gradient-mls-2"}},
      {"laplacian-mls-2", {"laplacian-mls-2"}},
      {"gradient-msph", {"gradient-msph"}},
      {"laplacian-msph", {"laplacian-msph"}},
      {"laplacian-icspm", {"laplacian-icspm"}},
      {"laplacian-cspm", {"laplacian-cspm"}},
      {"laplacian-kgf-improved", {"laplacian-kgf-improved"}},
      {"laplacian-rkpm-2", {"laplacian-rkpm-2"}},
      {"all-mls-2", {"value-mls-2", "gradient-mls-2", "hessian-mls-2", "laplacian-mls-2"}}};
  for (const auto& [form, schemes] : forms)
    add("op:forms/impl:gradpsi/scheme:" + form, scene,
        [=](benchmark::State& state, Prepared& p, int threads) {
          std::vector<Operator> all = assemble(schemes, p.cloud, p.near, assembly_options(threads));
          for (auto _ : state) {
            reassemble(schemes, p.cloud, p.near, all, assembly_options(threads));
            benchmark::ClobberMemory();
          }
          count_weights(state, p, entries(all), 8);
        });
}

void add_probes(const Scene& scene) {
  for (const int probes : {1'000, 100'000})
    for (const bool one_cell : {true, false})
      add("op:probes/impl:" + std::string(one_cell ? "one-cell-" : "anywhere-") +
              std::to_string(probes) + "/scheme:value-mls-2",
          scene, [=](benchmark::State& state, Prepared& p, int threads) {
            const gradpsi::Cloud at = gradpsi::make_cloud(
                {.dimension = 1, .points_per_side = probes * scene.dimension, .jitter = 0.5});
            gradpsi::Positions x(probes, scene.dimension);
            for (Eigen::Index k = 0; k < x.size(); ++k)  // a stride that spreads them over the box
              x.data()[k] = at.positions()(k * 7919 % at.size(), 0);
            if (one_cell) x = (x / scene.points_per_side).array() + 0.5;
            for (auto _ : state)
              benchmark::DoNotOptimize(gradpsi::interpolate("value-mls-2", p.cloud, x,
                                                            p.near.supports, {.threads = threads}));
            count(state, {.points = static_cast<double>(probes)});
          });
}

void add_fused_weights(const Scene& scene) {
  const auto add_by = [&](const std::string& impl, auto make) {
    add("op:fused/impl:" + impl + pair_name, scene,
        [=](benchmark::State& state, Prepared& p, int threads) {
          double made = 0;
          for (auto _ : state) made = entries(make(p, threads));
          count_weights(state, p, made, 12);
        });
  };
  add_by("gradpsi", [](const Prepared& p, int threads) {
    return assemble(pair, p.cloud, p.near, assembly_options(threads));
  });
  add_by("gradpsi-separate", one_after_the_other);
}

void add_fill(const Scene& scene) {
  add_fill_by("triplets", scene, from_triplets);
  add_fill_by("direct", scene, copied);
}
