#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>

namespace gradpsi::apps {

/// Ends the program's work with this message, "error: ..".
using Fail = std::function<void(const std::string& message)>;

/// Runs the subcommand that the command line asks for. `speaks`: whether help goes to standard output.
/// @return  the exit code: 0, 1 for bad data, 2 for bad usage
int run_command_line(CLI::App& app, int argc, char** argv, bool speaks, const Fail& fail);

/// OpenBLAS starts its threads when the program is loaded, and they spin for a tenth of a second on the
/// cores that the search wants. Sent home, they come back when there is something to factorise.
void send_blas_threads_home();

}  // namespace gradpsi::apps
