#include "multigrid/hierarchy.hpp"

#include <numeric>
#include <utility>

#include "gradpsi/error.hpp"
#include "gradpsi/neighbours.hpp"
#include "multigrid/compact.hpp"
#include "multigrid/for_petsc.hpp"
#include "multigrid/thinning.hpp"
#include "multigrid/transfer.hpp"
#include "search/check.hpp"

namespace gradpsi {
namespace {

constexpr int few = 500;          // points that are not worth thinning
constexpr double thinner = 0.75;  // of the points, at most, are kept

Cloud part(const Cloud& cloud, const std::vector<int>& points, DenseVector volumes) {
  Positions x(points.size(), cloud.dimension());
  for (std::size_t k = 0; k < points.size(); ++k) x.row(k) = cloud.positions().row(points[k]);
  return Cloud(std::move(x), {.volumes = std::move(volumes), .box = cloud.box()});
}

/// Points of one level with what is made of them.
struct Stage {
  Cloud cloud;
  Medium medium;
  std::vector<char> left_out = std::vector<char>(cloud.size(), false);
  DenseVector spacings = gradpsi::spacings(cloud);
  Neighbours near = {};
  double reach = 0;  // of these, in spacings

  /// Finds the lists, without the check that most have a neighbour; false if they would be longer than half a box.
  bool find(double how_far, int threads) {
    reach = how_far;
    const DenseVector supports = reach * spacings;
    if (!(supports.maxCoeff() <= largest_support(cloud))) return false;
    std::vector<int> all(cloud.size());
    std::iota(all.begin(), all.end(), 0);
    near = find_neighbours(cloud, supports, all, threads);
    return true;
  }

  /// Whether the medium jumps between neighbours.
  bool has_jumps() const {
    if (!is_jump(medium.diffusivities.minCoeff(), medium.diffusivities.maxCoeff())) return false;
    for (int i = 0; i < cloud.size(); ++i)
      for (const int j : near.of(i))
        if (!left_out[i] && !left_out[j] &&
            is_jump(medium.diffusivities[i], medium.diffusivities[j]))
          return true;
    return false;
  }

  SingleSparseMatrix equations(double scale, int threads) const {
    return compact_matrix(cloud, spacings, near, medium, left_out, scale, threads);
  }
};

std::vector<CoarseLevel> levels_below(Stage fine, double scale, int threads) {
  std::vector<CoarseLevel> levels;
  if (!fine.find(fine.cloud.dimension() == 3 ? short_reach : list_reach, threads)) return levels;
  const bool jumps = fine.has_jumps();
  if (jumps && fine.reach < list_reach && !fine.find(list_reach, threads)) return levels;
  SingleSparseMatrix finer;  // where it jumps: the equations of the finer level
  if (jumps) finer = fine.equations(scale, threads);
  while (levels.empty() || fine.cloud.size() > few) {
    const std::vector<int> kept = thin(fine.cloud, fine.spacings, fine.near, fine.left_out);
    if (kept.empty()) break;
    if (static_cast<double>(kept.size()) > thinner * fine.cloud.size() && fine.cloud.size() > few)
      throw NoHierarchy("points are farther apart than their volumes say");
    Transfer to = transfer(fine.cloud, fine.spacings, fine.near, fine.reach, kept, fine.left_out,
                           fine.medium, threads);
    Stage coarse{part(fine.cloud, kept, std::move(to.volumes)), std::move(to.medium)};
    if (!coarse.find(list_reach, threads)) break;
    SingleSparseMatrix matrix =
        jumps ? SingleSparseMatrix(to.restriction * SingleSparseMatrix(finer * to.interpolation))
              : coarse.equations(scale, threads);
    if (jumps) finer = matrix;
    levels.push_back({std::move(to.interpolation), std::move(to.restriction), std::move(matrix),
                      coarse.cloud.volumes(), coarse.medium.masses});
    fine = std::move(coarse);
  }
  return levels;
}

}  // namespace

std::vector<CoarseLevel> coarser_levels(const Cloud& cloud, const Medium& medium,
                                        const std::vector<char>& left_out, double scale,
                                        int threads) try {
  return levels_below({cloud, medium, left_out}, scale, threads);
} catch (const InvalidInput& error) {
  throw NoHierarchy(error.what());
}

void renew(CoarseLevel& level, const MediumChange& change, double scale) {
  SingleSparseMatrix& S = level.matrix;
  change_masses(change, level.volumes, level.masses);
  for (int i = 0; i < S.rows(); ++i) {
    float* diagonal = nullptr;
    double others = 0;
    for (SingleSparseMatrix::InnerIterator a(S, i); a; ++a) {
      if (a.col() == i) {
        diagonal = &a.valueRef();
      } else {
        a.valueRef() *= static_cast<float>(change.diffusivity);
        others += a.value();
      }
    }
    if (diagonal) *diagonal = static_cast<float>(scale * level.masses[i] - others);
  }
}

}  // namespace gradpsi
