// gradpsi: sparse gradient and Laplacian matrices of point clouds. See `gradpsi --help`.

#include <csignal>
#include <iostream>
#include <string>

#include "commands.hpp"
#include "common/command_line.hpp"

int main(int argc, char** argv) {
  using namespace gradpsi::apps;
  std::signal(SIGPIPE, SIG_IGN);  // a closed pipe or a limit on sizes becomes a failed write
  std::signal(SIGXFSZ, SIG_IGN);
  send_blas_threads_home();

  CLI::App app("Sparse gradient and Laplacian matrices of point clouds, by SPH-like schemes.",
               "gradpsi");
  app.set_version_flag("--version", GRADPSI_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Example: gradpsi assemble points.csv --scheme laplacian-mixed-soc --support-ratio 3 "
      "-o laplacian.mtx");
  add_schemes(app);
  add_assemble(app);
  add_derive(app);
  add_diffuse(app);
  add_inspect(app);
  add_converge(app);
  add_stability(app);
  add_tradeoff(app);
  add_advise(app);
  add_spmv(app);
  add_manual(app);

  return run_command_line(app, argc, argv, true, [](const std::string& message) {
    std::cerr << "error: " << message << '\n';
  });
}
