// The second example by several processes: mpirun -n 2 build/examples/5_processes
#include <gradpsi/gradpsi.hpp>
#include <gradpsi/petsc.hpp>
#include <iostream>

int main(int argc, char** argv) {
  PetscInitialize(&argc, &argv, nullptr, nullptr);  // -ksp_monitor and such go to PETSc
  int rank, processes;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &processes);
  {
    namespace petsc = gradpsi::petsc;
    const gradpsi::Table share = gradpsi::read_csv("apps/data/letters.csv", rank, processes);
    const petsc::Partition points(PETSC_COMM_WORLD, gradpsi::make_cloud(share));
    const Eigen::VectorXd support = Eigen::VectorXd::Constant(1, 3 * petsc::spacing(points));
    const petsc::Subdomain mine(points, support);  // own points and, around them, others'
    const gradpsi::Neighbours near = petsc::find_neighbours(mine, support);
    gradpsi::Operator laplacian = petsc::assemble("laplacian-mixed-zoc", mine, near);

    const auto x = points.cloud().positions().col(0).array();
    Eigen::VectorXd u = (x <= 2.101).cast<double>();  // of own points
    gradpsi::FixedValues ends;
    for (int k = 0; k < u.size(); ++k)
      if (x[k] <= 2.101 || x[k] >= 2.449) ends.points.push_back(mine.own()[k]);

    petsc::ImplicitDiffusion heat(mine, std::move(laplacian), {.fixed = ends}, {.time_step = 0.01});
    for (int n = 0; n < 200; ++n) heat.step(u);
    double sum = u.sum();
    MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    if (rank == 0)
      std::cout << heat.solver().description << ", mean temperature " << sum / points.size()
                << '\n';
  }
  PetscFinalize();
}
