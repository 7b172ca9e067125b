// gradpsi: sparse gradient and Laplacian matrices of point clouds. See `gradpsi --help`.

#include <dlfcn.h>

#include <csignal>
#include <exception>
#include <iostream>
#include <new>
#include <string>

#include "commands.hpp"

namespace {

/// The usage line of the subcommand that was named, or of the program.
std::string usage(const CLI::App& app) {
  const auto named = app.get_subcommands();
  const std::string help = named.empty() ? app.help() : named.front()->help(app.get_name());
  const auto begin = help.find("Usage:");
  return begin == help.npos ? "" : help.substr(begin, help.find('\n', begin) - begin);
}

/// What was wrong with the command line; CLI11 does not name an unknown subcommand.
std::string complaint(const CLI::App& app, const CLI::ParseError& error, int argc, char** argv) {
  if (!app.get_subcommands().empty() || argc < 2 || argv[1][0] == '-') return error.what();
  std::string text = "unknown subcommand '" + std::string(argv[1]) + "'; valid:";
  for (const auto* command : app.get_subcommands({})) text += ' ' + command->get_name();
  return text;
}

/// OpenBLAS starts its threads when the program is loaded, and they spin for a tenth of a second on the
/// cores that the search wants. Sent home, they come back when there is something to factorise.
void send_blas_threads_home() {
  if (void* const shutdown = dlsym(RTLD_DEFAULT, "blas_thread_shutdown_"))
    reinterpret_cast<int (*)()>(shutdown)();
}

int fail(const std::string& message) {
  std::cerr << "error: " << message << '\n';
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
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

  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    std::cerr << "error: " << complaint(app, error, argc, argv) << '\n' << usage(app) << '\n';
    return 2;
  } catch (const std::bad_alloc&) {
    return fail("out of memory");
  } catch (const std::exception& error) {
    return fail(error.what());
  }
  std::cout.flush();
  return std::cout ? 0 : fail("cannot write to standard output");
}
