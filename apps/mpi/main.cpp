// gradpsi-mpi: implicit diffusion by several processes. See `gradpsi-mpi --help`.

#include <petscsys.h>

#include <cctype>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "commands/diffuse.hpp"
#include "common/process.hpp"
#include "mpi/machine.hpp"

namespace gradpsi::apps {

namespace {

/// The command line's arguments, parted into ours and PETSc's: -name, and a value that follows it.
struct Arguments {
  Arguments(int argc, char** argv) : ours{argv[0]}, petsc{argv[0]} {
    const auto is_petsc = [](const char* a) {
      char* end;
      std::strtod(a, &end);  // -inf is a number
      return a[0] == '-' && std::isalpha(static_cast<unsigned char>(a[1])) && a[2] != '\0' &&
             *end != '\0';
    };
    for (int k = 1; k < argc; ++k) {
      if (!is_petsc(argv[k])) {
        ours.push_back(argv[k]);
        continue;
      }
      petsc.push_back(argv[k]);
      const bool negative = k + 1 < argc && argv[k + 1][0] == '-' &&
                            std::isdigit(static_cast<unsigned char>(argv[k + 1][1]));
      if (k + 1 < argc && (argv[k + 1][0] != '-' || negative)) petsc.push_back(argv[++k]);
    }
  }

  std::vector<char*> ours, petsc;
};

/// An error that all processes meet is said once. If within some seconds others do not come, they wait for
/// this process in vain: it says its own and ends them all.
void fail_together(const std::string& message) {
  constexpr int patience = 5000;  // milliseconds
  int rank, all_here = 0;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Request request;
  MPI_Ibarrier(PETSC_COMM_WORLD, &request);
  for (int waited = 0; waited < patience && !all_here; ++waited) {
    MPI_Test(&request, &all_here, MPI_STATUS_IGNORE);
    if (!all_here) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (all_here && rank > 0) return;
  std::cerr << "error: " + message + "\n" << std::flush;
  if (!all_here) MPI_Abort(PETSC_COMM_WORLD, 1);
}

/// Options that PETSc has not been asked for: misspelt ones, most likely. PETSc is not to list them again.
void warn_of_unused_options(bool speaks) {
  PetscInt count;
  char **names, **values;
  if (PetscOptionsLeftGet(nullptr, &count, &names, &values) != 0) return;
  for (PetscInt k = 0; k < count; ++k) {
    const std::string name = '-' + std::string(names[k]);
    if (speaks) std::cerr << "warning: PETSc did not use the option " << name << '\n';
    PetscOptionsClearValue(nullptr, name.c_str());
  }
  PetscOptionsLeftRestore(nullptr, &count, &names, &values);
}

std::function<void()> declare_mpi_diffuse(Options& options) {
  return declare_diffuse(
      options,
      {.call = "mpirun -n 2 gradpsi-mpi",
       .output = "OUT.csv: the input's columns, the field as it is at last. OUT.vtu: the same as "
                 "OUT.pvtu\nand a piece a process, OUT_rank0.vtu, .. And a picture of it, OUT.png",
       .machine = several_processes});
}

}  // namespace

}  // namespace gradpsi::apps

int main(int argc, char** argv) {
  using namespace gradpsi::apps;
  prepare_process();
  Arguments arguments(argc, argv);
  int petsc_count = static_cast<int>(arguments.petsc.size());
  arguments.petsc.push_back(nullptr);
  char** petsc = arguments.petsc.data();
  if (PetscInitialize(&petsc_count, &petsc, nullptr, nullptr) != 0) return 1;
  PetscPopSignalHandler();
  PetscPushErrorHandler(PetscIgnoreErrorHandler, nullptr);  // errors are exceptions
  int rank;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);

  static constexpr Command commands[] = {
      {"diffuse", "Implicit diffusion of a field, or the steady field, with boundary conditions.",
       declare_mpi_diffuse}};
  const Program program{
      .name = "gradpsi-mpi",
      .description = "Implicit diffusion on a cloud of points, by several processes.",
      .footer =
          "Options of PETSc such as -ksp_type, -pc_type and -ksp_monitor go before what is "
          "chosen.\n"
          "Example: mpirun -n 2 gradpsi-mpi diffuse points.csv --field T --scheme "
          "laplacian-mixed-zoc --support-ratio 3 --steady --fixed wall -o T.csv -ksp_monitor",
      .commands = commands};
  const int count = static_cast<int>(arguments.ours.size());
  arguments.ours.push_back(nullptr);
  const int code = run(program, count, arguments.ours.data(), rank == 0, fail_together);
  warn_of_unused_options(code == 0 && rank == 0);
  PetscFinalize();
  return code;
}
