#include "clouds.hpp"

#include <algorithm>
#include <random>

namespace gradpsi {

Cloud irregular_cloud(int dimension, int points_per_side, std::uint64_t seed) {
  const Cloud lattice = make_cloud(Lattice{
      .dimension = dimension, .points_per_side = points_per_side, .jitter = 0.25, .seed = seed});
  std::mt19937_64 generator(seed + 1000);
  std::vector<int> order(lattice.size());
  for (int i = 0; i < lattice.size(); ++i) order[i] = i;
  std::shuffle(order.begin(), order.end(), generator);
  Eigen::VectorXd volumes = lattice.volumes();
  std::uniform_real_distribution<double> factor(0.7, 1.4);
  for (double& v : volumes) v *= factor(generator);
  return Cloud(lattice.positions()(order, Eigen::all), {.volumes = volumes});
}

Cloud periodic(const Cloud& cloud) {
  CloudOptions options{.volumes = cloud.volumes()};
  std::fill_n(options.box.begin(), cloud.dimension(), 1.0);
  return Cloud(cloud.positions(), options);
}

Eigen::VectorXd uneven_supports(const Cloud& cloud) {
  return Eigen::VectorXd::LinSpaced(cloud.size(), 0.93, 1) * rich_support(cloud);
}

double rich_support(const Cloud& cloud) {
  return (cloud.dimension() == 1 ? 3.2 : 2.9) * cloud.spacing();
}

std::vector<Scheme> compact_schemes(int least) {
  std::vector<Scheme> chosen;
  for (const Scheme& scheme : schemes())
    if (degree(scheme) >= least && degree(scheme) <= 2 &&
        scheme.consistency != Consistency::Positive)
      chosen.push_back(scheme);
  return chosen;
}

SparseMatrix sparse(const Eigen::MatrixXd& dense) {
  SparseMatrix matrix = dense.sparseView();
  matrix.makeCompressed();
  return matrix;
}

std::string identifier(std::string text) {
  std::ranges::replace(text, '-', '_');
  return text;
}

std::string case_name(const testing::TestParamInfo<SchemeAndDimension>& info) {
  const auto& [scheme, dimension] = info.param;
  return identifier(name(scheme)) + "_" + std::to_string(dimension) + "d";
}

}  // namespace gradpsi
