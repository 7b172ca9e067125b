#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace gradpsi::apps {

/// A command line that cannot be understood, beyond what is said of an option where it is declared. The
/// program ends with exit code 2 and the usage line.
struct BadUsage : std::runtime_error {
  BadUsage(const std::string& option, const std::string& wrong)
      : std::runtime_error(option + ": " + wrong) {}
};

/// The names in "a,b,c", the value of that option.
/// @throws BadUsage  if one is empty
std::vector<std::string> listed(const std::string& option, const std::string& list);

/// What is wrong with an option's value as it was typed; "" if nothing is.
using Check = std::function<std::string(const std::string& given)>;

/// An empty shell variable must not become "no such column".
std::string not_empty(const std::string& given);

/// An option that has been declared.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}
  Option required();
  Option needs(const Option& other);
  Option excludes(const Option& other);
  Option check(const Check& check);

 private:
  CLI::Option* option_;
};

/// Inclusive.
struct Limits {
  int least, most;
};
inline constexpr Limits from_one{1, 2147483647}, thread_limits{0, 1024};

/// Declares the options of a command: each sets the variable that it is given, which --help shows as the default
/// unless it is empty. What has no dash before its name is positional. `type` stands for the value in --help.
class Options {
 public:
  explicit Options(CLI::App& command) : command_(command) {}

  Option text(const std::string& name, std::string& value, const std::string& type,
              const std::string& description);
  Option file(const std::string& name, std::filesystem::path& value, const std::string& type,
              const std::string& description);
  Option number(const std::string& name, double& value, const std::string& type,
                const std::string& description);
  Option number(const std::string& name, std::optional<double>& value, const std::string& type,
                const std::string& description);
  Option count(const std::string& name, int& value, const Limits& limits, const std::string& type,
               const std::string& description);
  Option count(const std::string& name, std::optional<int>& value, const Limits& limits,
               const std::string& type, const std::string& description);
  /// One of the `choices`.
  Option choice(const std::string& name, std::string& value,
                const std::vector<std::string>& choices, const std::string& type,
                const std::string& description);
  Option choice(const std::string& name, std::optional<std::string>& value,
                const std::vector<std::string>& choices, const std::string& type,
                const std::string& description);
  /// read(given) makes of it what it stands for, or throws BadUsage.
  Option parsed(const std::string& name, const std::function<void(const std::string& given)>& read,
                const std::string& type, const std::string& description);
  Option flag(const std::string& name, bool& value, const std::string& description);

  /// "Example: gradpsi ..", or "Examples:" and lines.
  void examples(const std::string& text);

 private:
  CLI::App& command_;
};

/// A row of a program's table. `declare` says what the options are, and returns what is done once they are
/// known. It is called even if the command is not.
struct Command {
  const char* name;
  const char* description;
  std::function<void()> (*declare)(Options& options);
};

/// A program and what --help says of it.
struct Program {
  const char *name, *description, *footer;
  std::span<const Command> commands;
};

/// Says that the program has failed: "error: ..".
using Fail = std::function<void(const std::string& message)>;

/// Does what the command line asks for. `speaks`: whether help goes to standard output.
/// @return  the exit code: 0, 1 for bad data, 2 for bad usage
int run(const Program& program, int argc, char** argv, bool speaks, const Fail& fail);

/// What --help says of an option; `traits` are the type, the default, and what it needs or excludes.
struct OptionHelp {
  std::string name, traits, description;
};
/// What --help says of a command.
struct CommandHelp {
  std::string name, description, examples;
  std::vector<OptionHelp> positionals, options;
};
CommandHelp help(const Command& command);

}  // namespace gradpsi::apps
