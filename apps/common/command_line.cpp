#include "common/command_line.hpp"

#include <dlfcn.h>

#include <exception>
#include <iostream>
#include <new>

namespace gradpsi::apps {

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

}  // namespace

void send_blas_threads_home() {
  if (void* const shutdown = dlsym(RTLD_DEFAULT, "blas_thread_shutdown_"))
    reinterpret_cast<int (*)()>(shutdown)();
}

int run_command_line(CLI::App& app, int argc, char** argv, bool speaks, const Fail& fail) {
  try {
    app.parse(argc, argv);
    std::cout.flush();
    if (std::cout) return 0;
    fail("cannot write to standard output");
  } catch (const CLI::Success& help) {
    return speaks ? app.exit(help) : 0;
  } catch (const CLI::ParseError& error) {
    fail(complaint(app, error, argc, argv) + "\n" + usage(app));
    return 2;
  } catch (const std::bad_alloc&) {
    fail("out of memory");
  } catch (const std::exception& error) {
    fail(error.what());
  }
  return 1;
}

}  // namespace gradpsi::apps
