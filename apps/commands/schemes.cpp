// gradpsi schemes: the table of schemes, or of the systems that the paper cites, for people or (--json) for scripts.

#include <algorithm>
#include <gradpsi/cited.hpp>
#include <gradpsi/scheme.hpp>
#include <iostream>

#include "commands.hpp"
#include "common/report.hpp"

namespace gradpsi::apps {

namespace {

using Line = std::vector<std::string>;

// Columns as wide as their longest entry, two spaces between them.
void print_columns(const std::vector<Line>& lines) {
  std::vector<std::size_t> widths(lines.front().size(), 0);
  for (const Line& line : lines)
    for (std::size_t k = 0; k < line.size(); ++k) widths[k] = std::max(widths[k], line[k].size());
  for (const Line& line : lines) {
    std::string text;
    for (std::size_t k = 0; k < line.size(); ++k) {
      text += line[k];
      if (k + 1 < line.size()) text.append(widths[k] + 2 - line[k].size(), ' ');
    }
    std::cout << text << '\n';
  }
}

void print_schemes() {
  std::cout << "(grad u)_i = sum_j G_ij (u_j - u_i), (lap u)_i = sum_j psi_ij (u_j - u_i),\n"
               "r_ij = x_j - x_i, e_ij = r_ij / r, omega_j the volume of point j, W(r) the kernel, "
               "d the dimension;\nB_i, C0_i, C1_i, c_i and m_i are what meets the conditions in "
               "row i, p the monomials of r_ij;\n"
               "in rkpm-P p_1 = (1, p), and b makes these functions N_j reproduce polynomials;\n"
               "<t> = sum omega t / sum omega W, j = i among them, but not in kgf-improved's sum; "
               "[n] is the paper's equation;\n"
               "the last column holds with one support for all points.\n\n";
  std::vector<Line> lines = {{"name", "G_ij or psi_ij", "conditions met", "omega_i a_ij"}};
  for (const Scheme& scheme : schemes())
    lines.push_back(
        {name(scheme), formula(scheme), std::string(conditions(scheme)),
         symmetry(scheme) == Symmetry::None ? "-" : std::string(name(symmetry(scheme)))});
  print_columns(lines);
}

void print_cited() {
  std::cout
      << "The systems that the paper cites, by its reference; every name can be given where a "
         "scheme "
         "is asked for.\nIn conditions, [n] is the paper's equation; `gradpsi schemes` explains "
         "the formulas.\n\n";
  std::vector<Line> lines = {
      {"ref", "name", "system", "G_ij or psi_ij", "conditions met", "equal to"}};
  for (const CitedSystem& system : cited_systems())
    lines.push_back({std::string(system.reference), std::string(system.name),
                     std::string(system.who), formula(system.name),
                     std::string(conditions(system.name)),
                     system.equal_to.empty() ? "-" : std::string(system.equal_to)});
  print_columns(lines);
}

}  // namespace

std::function<void()> declare_schemes(Options& options) {
  struct Wanted {
    bool cited = false, json = false;
  };
  auto wanted = std::make_shared<Wanted>();
  options.flag("--cited", wanted->cited,
               "The systems that the paper cites, with what each is equal to");
  options.flag("--json", wanted->json, "The same as a JSON array");
  options.examples("Examples:\n  gradpsi schemes --json\n  gradpsi schemes --cited");
  return [wanted] {
    if (wanted->json)
      std::cout << (wanted->cited ? json(cited_systems()) : json(schemes()));
    else if (wanted->cited)
      print_cited();
    else
      print_schemes();
  };
}

}  // namespace gradpsi::apps
