// The steady flow in a square cavity whose lid moves, at Re 100, on scattered points that stay where they are.
//
//     cavity [POINTS_PER_SIDE]     (65)
//
// Walls have a lattice's points but for the corners, where the lid's velocity jumps; those inside are jittered by
// 0.2 of the spacing. Each step
//
//     v = u - dt (u . grad) u + dt nu lap v    implicit in v, which is that of the walls there
//     lap p = div v / dt                       n . grad p = 0 at walls, whose rows know that (with_walls)
//     u = v - dt grad p                        inside
//
// and both matrices are factorised once. Steps go on until nothing changes any more.
//
// Prints a CSV: u_x on x = 1/2 and u_y on y = 1/2 in steps of 1/128, by the polynomials of degree 2 around the
// nearest point, and what U. Ghia, K. N. Ghia and C. T. Shin, J. Comput. Phys. 48 (1982), have in tables I and II
// of their 129 x 129 grid. Expect 7e-3 as the largest difference. cavity.gp draws it.
#include <cmath>
#include <cstdio>
#include <gradpsi/gradpsi.hpp>
#include <map>
#include <string>
#include <vector>

#include "argument.hpp"

namespace {

using gradpsi::VectorOperator;
using Field = Eigen::VectorXd;
using Vectors = Eigen::MatrixXd;  // n x 2

constexpr double viscosity = 0.01;

/// Velocities by 128 times the coordinate: u_x on x = 1/2, u_y on y = 1/2.
const std::map<int, double> published[2] = {{{0, 0},
                                             {7, -0.03717},
                                             {8, -0.04192},
                                             {9, -0.04775},
                                             {13, -0.06434},
                                             {22, -0.10150},
                                             {36, -0.15662},
                                             {58, -0.21090},
                                             {64, -0.20581},
                                             {79, -0.13641},
                                             {94, 0.00332},
                                             {109, 0.23151},
                                             {122, 0.68717},
                                             {123, 0.73722},
                                             {124, 0.78871},
                                             {125, 0.84123},
                                             {128, 1}},
                                            {{0, 0},
                                             {8, 0.09233},
                                             {9, 0.10091},
                                             {10, 0.10890},
                                             {12, 0.12317},
                                             {20, 0.16077},
                                             {29, 0.17507},
                                             {30, 0.17527},
                                             {64, 0.05454},
                                             {103, -0.24533},
                                             {110, -0.22445},
                                             {116, -0.16914},
                                             {121, -0.10313},
                                             {122, -0.08864},
                                             {123, -0.07391},
                                             {124, -0.05906},
                                             {128, 0}}};

struct Cavity {
  gradpsi::Cloud cloud{gradpsi::Positions(0, 2)};
  gradpsi::FluxWalls walls;  // without a flux
};

Cavity make_cavity(int side) {
  const double dx = 1.0 / (side - 1);
  gradpsi::Lattice lattice{.points_per_side = side, .lower = -dx / 2, .upper = 1 + dx / 2};
  const gradpsi::Positions even = make_cloud(lattice).positions();
  lattice.jitter = 0.2;
  const gradpsi::Cloud jittered = make_cloud(lattice);
  gradpsi::Positions x = jittered.positions(), normals(x.rows(), 2);
  std::vector<int> kept, walls;  // among those of the lattice
  Cavity cavity;
  for (int i = 0; i < x.rows(); ++i) {
    for (int a = 0; a < 2; ++a) normals(i, a) = std::trunc((2 * even(i, a) - 1) / (1 - dx));
    if (normals.row(i).squaredNorm() == 2) continue;  // a corner
    if (!normals.row(i).isZero()) {
      cavity.walls.points.push_back(static_cast<int>(kept.size()));
      walls.push_back(i);
      for (int a = 0; a < 2; ++a)
        x(i, a) = normals(i, a) == 0 ? even(i, a) : (normals(i, a) + 1) / 2;
    }
    kept.push_back(i);
  }
  cavity.walls.normals = normals(walls, Eigen::all);
  cavity.cloud = gradpsi::Cloud(x(kept, Eigen::all), {.volumes = jittered.volumes()(kept)});
  return cavity;
}

class Flow {
 public:
  Flow(const Cavity& cavity, double dx)
      : dt_(dx / 2),
        near_(find_neighbours(cavity.cloud, 3.2 * dx)),
        operators_(
            assemble({"gradient-ls-2", "laplacian-ls-2", "hessian-ls-2"}, cavity.cloud, near_)),
        viscous_(cavity.cloud, operators_[1], {.fixed = {cavity.walls.points}},
                 {.diffusivity = viscosity, .time_step = dt_}),
        poisson_(cavity.cloud,
                 with_walls(operators_[1], cavity.cloud, near_, cavity.walls).laplacian, {},
                 {.solves = 10'000}),
        inside_(Field::Ones(cavity.cloud.size())),
        pressure_(Field::Zero(cavity.cloud.size())),
        u_(Vectors::Zero(cavity.cloud.size(), 2)) {
    for (const int i : cavity.walls.points) {
      inside_[i] = 0;
      u_(i, 0) = cavity.cloud.positions()(i, 1) == 1;  // the lid
    }
  }

  /// @return  the largest change of a velocity per time
  double step() {
    multiply(VectorOperator::VelocityGradient, gradient(), u_, du_);
    v_ = u_;
    for (int a = 0; a < 2; ++a)
      v_.col(a) -=
          dt_ * inside_.cwiseProduct(u_.cwiseProduct(du_.middleCols(2 * a, 2)).rowwise().sum());
    viscous_.step(v_);
    multiply(VectorOperator::Divergence, gradient(), v_, divergence_);
    poisson_.solve(divergence_.col(0) / dt_, pressure_);
    multiply(VectorOperator::Gradient, gradient(), pressure_, force_);
    v_ -= dt_ * inside_.asDiagonal() * force_;
    u_.swap(v_);
    return (u_ - v_).cwiseAbs().maxCoeff() / dt_;
  }

  /// The velocity's component `a` at a place r away from point i.
  double value(int a, Eigen::Index i, const Eigen::RowVector2d& r) const {
    const Field w = u_.col(a);
    const auto& H = operators_[2].axes;
    return w[i] + r[0] * gradient()[0].row(i).dot(w) + r[1] * gradient()[1].row(i).dot(w) +
           r[0] * r[0] / 2 * H[0].row(i).dot(w) + r[0] * r[1] * H[1].row(i).dot(w) +
           r[1] * r[1] / 2 * H[2].row(i).dot(w);
  }

 private:
  const std::vector<gradpsi::SparseMatrix>& gradient() const { return operators_[0].axes; }

  double dt_;
  gradpsi::Neighbours near_;
  std::vector<gradpsi::Operator> operators_;
  gradpsi::ImplicitDiffusion viscous_;
  gradpsi::Poisson poisson_;
  Field inside_, pressure_;
  Vectors u_, v_, du_, divergence_, force_;
};

}  // namespace

int main(int argc, char** argv) try {
  const int side = argc > 1 ? argument("POINTS_PER_SIDE", argv[1], 9) : 65;
  const Cavity cavity = make_cavity(side);
  Flow flow(cavity, 1.0 / (side - 1));
  while (flow.step() > 1e-6) continue;
  std::puts("component,coordinate,computed,published");
  double worst = 0;
  for (int a = 0; a < 2; ++a)
    for (int k = 0; k <= 128; ++k) {
      Eigen::RowVector2d at(0.5, 0.5);
      at[1 - a] = k / 128.0;
      Eigen::Index nearest;
      (cavity.cloud.positions().rowwise() - at).rowwise().squaredNorm().minCoeff(&nearest);
      const double u = flow.value(a, nearest, at - cavity.cloud.positions().row(nearest));
      std::printf("u_%c,%.7f,%.5f,", "xy"[a], k / 128.0, u);
      if (const auto known = published[a].find(k); known != published[a].end()) {
        std::printf("%.5f", known->second);
        worst = std::max(worst, std::abs(u - known->second));
      }
      std::puts("");
    }
  std::fprintf(stderr, "largest difference %.4f\n", worst);
} catch (const std::exception& error) {
  std::fprintf(stderr, "error: %s\n", error.what());
  return 1;
}
