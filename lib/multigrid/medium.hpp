#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/matrix.hpp"

namespace gradpsi {

/// -sum_j a_ij r_ij^2 / (2d): the diffusivity (times the time step, or not) with which row i of
/// A = I - dt nu Psi diffuses; exact for rows of second-order consistency.
/// @param A         rows of a matrix whose columns are the cloud's points
/// @param diagonal  the point that each row belongs to
DenseVector row_diffusivities(const SparseMatrix& A, const Cloud& points,
                              const std::vector<int>& diagonal, int threads);

/// What points conduct and hold: volume times a row of a matrix acts on smooth fields like
/// mass u - volume diffusivity lap u.
struct Medium {
  DenseVector diffusivities;  // length^2
  DenseVector masses;         // times the points' volumes; 0: to rounding
};

/// How rows of a part of the points hear of all others'; by default they are all.
struct OtherRows {
  std::function<double(const DenseVector&)> median = {};        // of all rows' values, from these
  std::function<DenseVector(const DenseVector&)> columns = {};  // the columns' values, from rows'
  std::function<bool(bool)> anywhere = {};
};

/// What a matrix's rows say of the medium. Rows that lost neighbours to eliminated points, whose sum is then large,
/// know less of the diffusivity: theirs is the mean of neighbours that lost none.
/// @param A         a row for each of n points; columns are these, or with `others` some more
/// @param volumes   n: the rows'
/// @param diffusivities  n: the rows'
/// @param left_out  n marks: rows that say nothing, as they hold boundary conditions
Medium medium_of(const SparseMatrix& A, const DenseVector& volumes, DenseVector diffusivities,
                 const std::vector<char>& left_out, const OtherRows& others, int threads);

/// A medium that is nearly a multiple of another one: kappa' = diffusivity kappa, and
/// mass' = rate' volume + diffusivity (mass - rate volume), as another time step, or the next one on points that have
/// moved, makes it.
struct MediumChange {
  double diffusivity;
  double rate_before, rate;
};
void change_masses(const MediumChange& change, const DenseVector& volumes, DenseVector& masses);
/// None where more than a point in a hundred differs from that by half.
std::optional<MediumChange> change(const Medium& before, const Medium& now, const Cloud& cloud);

/// Whether two points are in media that conduct so differently that a linear function is no solution.
inline bool is_jump(double diffusivity, double other) {
  constexpr double jump = 4;
  return diffusivity > jump * other || other > jump * diffusivity;
}

}  // namespace gradpsi
