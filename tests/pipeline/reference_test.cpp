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

class Reference : public testing::TestWithParam<Case> {};

TEST_P(Reference, AllSeventeenMatricesAgree) {
  const auto& [cloud_name, support, condition] = GetParam();
  const std::string stem = std::string(GRADPSI_REFERENCE_DIR) + "/" + cloud_name;
  const Cloud cloud = read_cloud(stem + ".csv");
  const Neighbours near = find_neighbours(cloud, support);
  const auto reference = read_reference(stem + ".triplets.csv");

  std::size_t compared = 0;
  for (const Scheme& scheme : classified_schemes()) {
    const Operator op = assemble(scheme, cloud, near);
    for (std::size_t axis = 0; axis < op.axes.size(); ++axis) {
      SparseMatrix rest = op.axes[axis];
      const auto& entries = reference.at({name(scheme), static_cast<int>(axis)});
      Eigen::VectorXd largest = Eigen::VectorXd::Zero(cloud.size());
      for (const auto& e : entries) largest[e.row] = std::max(largest[e.row], std::abs(e.value));
      for (const auto& e : entries) {
        // The bound of reference/README.md; zoc rows involve no system.
        const double cond = scheme.consistency == Consistency::Zoc ? 1 : condition;
        const double tolerance = 1e-13 * cond * largest[e.row];
        ASSERT_NEAR(op.axes[axis].coeff(e.row, e.col), e.value, tolerance)
            << name(scheme) << " axis " << axis << " (" << e.row << ", " << e.col << ")";
        rest.coeffRef(e.row, e.col) = 0;
        ++compared;
      }
      EXPECT_EQ(rest.norm(), 0) << "entries that the reference lacks";
    }
  }
  EXPECT_GT(compared, 1000u);
}

INSTANTIATE_TEST_SUITE_P(Clouds, Reference,
                         testing::Values(Case{"line", 0.10416666666666666, 9e2},
                                         Case{"square", 0.3571428571428571, 2e5},
                                         Case{"cube", 0.575, 2e6}),
                         [](const auto& p) { return p.param.cloud; });

}  // namespace
}  // namespace gradpsi
