// gradpsi manual: the manual page, written from the same options that --help shows.

#include <iostream>
#include <string>

#include "commands.hpp"

namespace gradpsi::apps {

namespace {

/// Text as troff takes it literally, line by line.
std::string literal(const std::string& text) {
  std::string result;
  for (const char c : text) {
    const bool begins_line = result.empty() || result.back() == '\n';
    if (begins_line && (c == '.' || c == '\'')) result += "\\&";
    if (c == '\\')
      result += "\\e";
    else if (c == '-')
      result += "\\-";
    else
      result += c;
  }
  return result;
}

void print_option(const OptionHelp& option) {
  std::cout << ".TP\n\\fB" << literal(option.name) << "\\fR" << literal(option.traits) << '\n'
            << literal(option.description) << '\n';
}

/// "Example: gradpsi ..." or "Examples:" and lines: set as they are.
void print_examples(const std::string& footer) {
  const auto colon = footer.find(':');
  const auto first = footer.find_first_not_of(" \n", colon + 1);
  std::cout << ".PP\n"
            << literal(footer.substr(0, colon + 1)) << "\n.PP\n.nf\n"
            << literal("  " + footer.substr(first)) << "\n.fi\n";
}

void print_command(const CommandHelp& command) {
  std::cout << ".SS gradpsi " << literal(command.name);
  for (const OptionHelp& option : command.positionals) std::cout << ' ' << literal(option.name);
  std::cout << '\n' << literal(command.description) << '\n';
  for (const OptionHelp& option : command.positionals) print_option(option);
  for (const OptionHelp& option : command.options) print_option(option);
  print_examples(command.examples);
}

void print() {
  std::cout
      << ".TH GRADPSI 1 \"\" \"gradpsi " << literal(GRADPSI_VERSION) << "\"\n"
      << ".SH NAME\n"
      << "gradpsi \\- sparse gradient and Laplacian matrices of point clouds\n"
      << ".SH SYNOPSIS\n"
      << ".B gradpsi\n"
      << ".I SUBCOMMAND\n[\\fIOPTIONS\\fR]\n"
      << ".SH DESCRIPTION\n"
      << "Turns points into sparse matrices, G and Psi, by the SPH\\-like schemes of R. Fatehi's\n"
      << "classification, least squares to degree 6 and minimal positive stencils; differentiates\n"
      << "fields and lets them diffuse; tells which scheme is fit for given points.\n"
      << ".SH POINTS\n"
      << "Points are a CSV file with a header row. Columns x, y and z give the dimension;\n"
      << "\\fBvolume\\fR and \\fBsupport\\fR are taken where they are there; every other column is "
         "a\n"
      << "field. Points count from 0 in messages, from 1 in Matrix Market files.\n"
      << ".SH SUBCOMMANDS\n";
  for (const Command& command : commands()) print_command(help(command));
  std::cout << ".SH EXIT STATUS\n"
            << "0; 1 for bad data, files that cannot be read or written, systems without a\n"
            << "solution; 2 for options that cannot be understood. After an error nothing is left\n"
            << "half written, and files that were there before are still there.\n";
}

}  // namespace

std::function<void()> declare_manual(Options& options) {
  options.examples("Example: gradpsi manual | man -l -");
  return print;
}

}  // namespace gradpsi::apps
