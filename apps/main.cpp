// gradpsi: sparse gradient and Laplacian matrices of point clouds. See `gradpsi --help`.

#include <iostream>

#include "commands.hpp"
#include "common/process.hpp"

int main(int argc, char** argv) {
  using namespace gradpsi::apps;
  prepare_process();
  const Program program{
      .name = "gradpsi",
      .description = "Sparse gradient and Laplacian matrices of point clouds, by SPH-like schemes.",
      .footer =
          "Example: gradpsi assemble points.csv --scheme laplacian-mixed-soc --support-ratio 3 "
          "-o laplacian.mtx",
      .commands = commands()};
  return run(program, argc, argv, true,
             [](const std::string& message) { std::cerr << "error: " << message << '\n'; });
}
