#include "common/cli.hpp"

#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <new>
#include <sstream>

namespace gradpsi::apps {

std::vector<std::string> listed(const std::string& option, const std::string& list) {
  std::vector<std::string> names;
  std::istringstream words(list + ',');
  for (std::string name; std::getline(words, name, ',');) {
    if (name.empty()) throw BadUsage(option, "a name is missing in '" + list + "'");
    names.push_back(name);
  }
  return names;
}

std::string not_empty(const std::string& given) { return given.empty() ? "must not be empty" : ""; }

Option Option::required() {
  option_->default_str("")->required();
  return *this;
}

Option Option::needs(const Option& other) {
  option_->needs(other.option_);
  return *this;
}

Option Option::excludes(const Option& other) {
  option_->excludes(other.option_);
  return *this;
}

Option Option::check(const Check& check) {
  option_->check(check);
  return *this;
}

namespace {

template <class T>
CLI::Option* declared(CLI::App& command, const std::string& name, T& value, const std::string& type,
                      const std::string& description) {
  return command.add_option(name, value, description)->type_name(type)->capture_default_str();
}

template <class T>
CLI::Option* declared(CLI::App& command, const std::string& name, std::optional<T>& value,
                      const std::string& type, const std::string& description) {
  return command.add_option(name, value, description)->type_name(type);
}

}  // namespace

Option Options::text(const std::string& name, std::string& value, const std::string& type,
                     const std::string& description) {
  return Option(declared(command_, name, value, type, description));
}

Option Options::file(const std::string& name, std::filesystem::path& value, const std::string& type,
                     const std::string& description) {
  return Option(declared(command_, name, value, type, description));
}

Option Options::number(const std::string& name, double& value, const std::string& type,
                       const std::string& description) {
  return Option(declared(command_, name, value, type, description));
}

Option Options::number(const std::string& name, std::optional<double>& value,
                       const std::string& type, const std::string& description) {
  return Option(declared(command_, name, value, type, description));
}

Option Options::count(const std::string& name, int& value, const Limits& limits,
                      const std::string& type, const std::string& description) {
  return Option(declared(command_, name, value, type, description)
                    ->check(CLI::Range(limits.least, limits.most)));
}

Option Options::count(const std::string& name, std::optional<int>& value, const Limits& limits,
                      const std::string& type, const std::string& description) {
  return Option(declared(command_, name, value, type, description)
                    ->check(CLI::Range(limits.least, limits.most)));
}

Option Options::choice(const std::string& name, std::string& value,
                       const std::vector<std::string>& choices, const std::string& type,
                       const std::string& description) {
  return Option(declared(command_, name, value, type, description)->check(CLI::IsMember(choices)));
}

Option Options::choice(const std::string& name, std::optional<std::string>& value,
                       const std::vector<std::string>& choices, const std::string& type,
                       const std::string& description) {
  return Option(declared(command_, name, value, type, description)->check(CLI::IsMember(choices)));
}

Option Options::parsed(const std::string& name,
                       const std::function<void(const std::string& given)>& read,
                       const std::string& type, const std::string& description) {
  return Option(
      command_.add_option_function<std::string>(name, read, description)->type_name(type));
}

Option Options::flag(const std::string& name, bool& value, const std::string& description) {
  return Option(command_.add_flag(name, value, description));
}

void Options::examples(const std::string& text) { command_.footer(text); }

namespace {

void add(CLI::App& app, const Command& command) {
  CLI::App* const added = app.add_subcommand(command.name, command.description);
  Options options(*added);
  added->callback(command.declare(options));
}

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

/// Its type, default, and what it needs or excludes, as CLI11 prints them beside its name.
std::string traits(const CLI::Option& option) { return CLI::Formatter().make_option_opts(&option); }

}  // namespace

int run(const Program& program, int argc, char** argv, bool speaks, const Fail& fail) {
  CLI::App app(program.description, program.name);
  app.set_version_flag("--version", GRADPSI_VERSION);
  app.require_subcommand(1);
  app.footer(program.footer);
  for (const Command& command : program.commands) add(app, command);
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
  } catch (const BadUsage& error) {
    fail(error.what() + ("\n" + usage(app)));
    return 2;
  } catch (const std::bad_alloc&) {
    fail("out of memory");
  } catch (const std::exception& error) {
    fail(error.what());
  }
  return 1;
}

CommandHelp help(const Command& command) {
  CLI::App program;
  add(program, command);
  const CLI::App& app = *program.get_subcommand(command.name);
  CommandHelp result{command.name, app.get_description(), app.get_footer(), {}, {}};
  for (const CLI::Option* option : app.get_options()) {
    const bool positional = option->get_positional();
    if (option->check_name("--help")) continue;
    (positional ? result.positionals : result.options)
        .push_back(
            {option->get_name(positional, true), traits(*option), option->get_description()});
  }
  return result;
}

}  // namespace gradpsi::apps
