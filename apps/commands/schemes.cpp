// gradpsi schemes: the table of schemes, for people or (--json) for scripts.

#include <cstdio>
#include <gradpsi/scheme.hpp>
#include <iostream>

#include "commands.hpp"
#include "common/report.hpp"

namespace gradpsi::apps {

namespace {

void print_table() {
  std::cout
      << "(grad u)_i = sum_j G_ij (u_j - u_i), (lap u)_i = sum_j psi_ij (u_j - u_i),\n"
         "r_ij = x_j - x_i, e_ij = r_ij / r, omega_j the volume of point j, W(r) the kernel, "
         "d the dimension;\nB_i, C0_i, C1_i are what meets the conditions in row i; [n] is the "
         "paper's equation;\nthe last column holds with one support for all points.\n\n";
  const auto line = [](auto... columns) { std::printf("%-25s  %-61s  %-53s  %s\n", columns...); };
  line("name", "G_ij or psi_ij", "conditions met", "omega_i a_ij");
  for (const Scheme& scheme : schemes())
    line(name(scheme).c_str(), formula(scheme).c_str(), conditions(scheme).data(),
         symmetry(scheme) == Symmetry::None ? "-" : name(symmetry(scheme)).data());
}

}  // namespace

std::function<void()> declare_schemes(Options& options) {
  auto json_wanted = std::make_shared<bool>(false);
  options.flag("--json", *json_wanted, "The same as a JSON array");
  options.examples("Example: gradpsi schemes --json");
  return [json_wanted] {
    if (*json_wanted)
      std::cout << json(schemes());
    else
      print_table();
  };
}

}  // namespace gradpsi::apps
