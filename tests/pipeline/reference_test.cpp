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
  double condition, cited;  // of the worst moment system, and among the cited systems and Hessians
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
  const auto& [cloud_name, support, condition, unused] = GetParam();
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

/// How much wider supports are than those of the others, and condition numbers larger.
struct Special {
  double support = 1, condition = 1;
};
Special special(const std::string& scheme) {
  if (scheme == "hessian-ls-3") return {.support = 1.5};
  if (scheme == "hessian-ls-4") return {.support = 2, .condition = 15};
  if (scheme == "laplacian-rkpm-2") return {.condition = 100};  // what its formula loses
  return {};
}

TEST_P(Reference, AllCitedSystemsAndHessiansAgree) {
  const auto& [cloud_name, support, unused, cited_condition] = GetParam();
  const std::string stem = std::string(GRADPSI_REFERENCE_DIR) + "/" + cloud_name;
  const Cloud cloud = read_cloud(stem + ".csv");
  const auto reference = read_reference(stem + ".cited.csv");
  std::size_t compared = 0;
  for (const auto& [scheme_and_axis, entries] : reference) {
    const auto& [scheme, axis] = scheme_and_axis;
    if (axis > 0) continue;
    const auto near = find_neighbours(cloud, special(scheme).support * support);
    compared += expect_agreement(assemble(scheme, cloud, near), scheme,
                                 special(scheme).condition * cited_condition, reference);
  }
  EXPECT_GT(compared, 3000u);
}

INSTANTIATE_TEST_SUITE_P(Clouds, Reference,
                         testing::Values(Case{"line", 0.10416666666666666, 9e2, 2e4},
                                         Case{"square", 0.3571428571428571, 2e5, 6e4},
                                         Case{"cube", 0.575, 2e6, 7e5}),
                         [](const auto& p) { return p.param.cloud; });

}  // namespace
}  // namespace gradpsi
