#pragma once

#include <petscmat.h>

#include <optional>
#include <string>
#include <vector>

#include "multigrid/hierarchy.hpp"
#include "petsc/walls.hpp"
#include "solve/coarse_cycle.hpp"
#include "solve/smoother.hpp"

namespace gradpsi::petsc {

/// What multigrid on the points is made of, by this process's rows.
struct RowPoints {
  Cloud cloud;  // with volumes
  Medium medium;
  Smoother smoother;       // of the rows as they are, not scaled
  std::vector<int> walls;  // those of the rows that hold a boundary condition
  std::vector<int>
      weak;  // and those that are corrected together, as the diagonals of some are weak
};

/// All points' coarser levels, which every process has, and what leads from its own points to the first of them.
struct RowLevels {
  RowPoints points;
  double unit;  // of the levels' matrices and residuals
  std::vector<CoarseLevel> coarser;
  SingleSparseMatrix interpolation;
};
/// Collective.
/// @throws NoHierarchy  in all processes: if points coincide, or volumes are no volumes of theirs
RowLevels row_levels(MPI_Comm comm, RowPoints points, int threads);

/// gradpsi::Multigrid for rows that are spread over processes: each solves the coarser levels by itself.
class Multigrid {
 public:
  /// Collective, as is apply().
  /// @param A      this process's rows times `scale`
  Multigrid(MPI_Comm comm, Mat A, RowLevels levels, const DenseVector& scale, int threads);

  /// z = about A^-1 r.
  void apply(Vec r, Vec z);

  std::string description() const;  ///< "multigrid on .. levels of points"

 private:
  MPI_Comm comm_;
  Mat A_;
  std::optional<WallCorrection> walls_, weak_;
  CoarseCycle coarse_;
  SingleSparseMatrix interpolation_, restriction_;
  DenseVector step_, weight_, own_;  // the smoother's, the residual's; memory
  Handle<Vec> product_;
};

}  // namespace gradpsi::petsc
