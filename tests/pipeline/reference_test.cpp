// Agreement with matrices that an independent numpy implementation computed (tests/reference).

#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>

#include "clouds.hpp"

namespace gradpsi {
namespace {

struct Case {
  const char* cloud;
  double support;
  double condition;  // of the worst moment system
};

struct Entry {
  int row, col;
  double value;
};

/// Reference entries by scheme and axis.
std::map<std::pair<std::string, int>, std::vector<Entry>> read_reference(const std::string& file) {
  std::map<std::pair<std::string, int>, std::vector<Entry>> entries;
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::array<std::string, 5> cells;
    std::istringstream row(line);
    for (auto& cell : cells) std::getline(row, cell, ',');
    entries[{cells[0], std::stoi(cells[1])}].push_back(
        {std::stoi(cells[2]), std::stoi(cells[3]), std::stod(cells[4])});
  }
  return entries;
}

/// Expects the operator's matrices to be those of the reference: to 1e-13 times the condition number of the
/// worst moment system and the row's largest entry, the bound of reference/README.md. Returns the entries.
std::size_t expect_agreement(
    const Operator& op, const std::string& scheme, double condition,
    const std::map<std::pair<std::string, int>, std::vector<Entry>>& reference) {
  std::size_t compared = 0;
  for (std::size_t axis = 0; axis < op.axes.size(); ++axis) {
    SparseMatrix rest = op.axes[axis];
    const auto& entries = reference.at({scheme, static_cast<int>(axis)});
    Eigen::VectorXd largest = Eigen::VectorXd::Zero(rest.rows());
    for (const auto& e : entries) largest[e.row] = std::max(largest[e.row], std::abs(e.value));
    for (const auto& e : entries) {
      EXPECT_NEAR(op.axes[axis].coeff(e.row, e.col), e.value, 1e-13 * condition * largest[e.row])
          << scheme << " axis " << axis << " (" << e.row << ", " << e.col << ")";
      rest.coeffRef(e.row, e.col) = 0;
      ++compared;
    }
    EXPECT_EQ(rest.norm(), 0) << "entries that the reference lacks";
  }
  return compared;
}

class Reference : public testing::TestWithParam<Case> {};

TEST_P(Reference, AllSeventeenMatricesAgree) {
  const auto& [cloud_name, support, condition] = GetParam();
  const std::string stem = std::string(GRADPSI_REFERENCE_DIR) + "/" + cloud_name;
  const Cloud cloud = read_cloud(stem + ".csv");
  const Neighbours near = find_neighbours(cloud, support);
  const auto reference = read_reference(stem + ".triplets.csv");
  std::size_t compared = 0;
  for (const Scheme& scheme : classified_schemes())  // zoc rows involve no system
    compared += expect_agreement(assemble(scheme, cloud, near), name(scheme),
                                 scheme.consistency == Consistency::Zoc ? 1 : condition, reference);
  EXPECT_GT(compared, 1000u);
}

TEST_P(Reference, HessiansAgree) {
  const auto& [cloud_name, support, condition] = GetParam();
  const std::string stem = std::string(GRADPSI_REFERENCE_DIR) + "/" + cloud_name;
  const Cloud cloud = read_cloud(stem + ".csv");
  const auto reference = read_reference(stem + ".hessian.csv");
  // Degrees 3 and 4 have wider supports and larger condition numbers, up to 9e5.
  std::map<std::string, double> ratios = {{"hessian-mixed-soc-ls", 1}, {"hessian-ls-2", 1}};
  if (cloud.dimension() < 3) ratios.insert({{"hessian-ls-3", 1.5}, {"hessian-ls-4", 2}});
  for (const auto& [scheme, ratio] : ratios)
    EXPECT_GT(expect_agreement(assemble(scheme, cloud, find_neighbours(cloud, ratio * support)),
                               scheme, std::max(condition, 9e5), reference),
              100u);
}

INSTANTIATE_TEST_SUITE_P(Clouds, Reference,
                         testing::Values(Case{"line", 0.10416666666666666, 9e2},
                                         Case{"square", 0.3571428571428571, 2e5},
                                         Case{"cube", 0.575, 2e6}),
                         [](const auto& p) { return p.param.cloud; });

}  // namespace
}  // namespace gradpsi
