#include "commands.hpp"

#include <array>

namespace gradpsi::apps {

std::span<const Command> commands() {
  static constexpr auto all = std::to_array<Command>({
      {"schemes", "List the schemes: formula, conditions, symmetry.", declare_schemes},
      {"assemble", "Write a scheme's matrices as Matrix Market.", declare_assemble},
      {"derive", "Differentiate fields given at the points of a file.", declare_derive},
      {"diffuse", "Implicit diffusion of a field, or the steady field, with boundary conditions.",
       declare_diffuse},
      {"inspect", "What an operator is fit for on these points, and which rows spoil it.",
       declare_inspect},
      {"converge",
       "The convergence study: error against spacing for the seventeen schemes\nof the paper, with "
       "figures.",
       declare_converge},
      {"stability", "The stability study: where Laplacians grow, by jitter, support and walls.",
       declare_stability},
      {"tradeoff", "Accuracy against cost: every scheme, support and kernel, with figures.",
       declare_tradeoff},
      {"advise", "Name the cheapest scheme and support that is accurate enough on given points.",
       declare_advise},
      {"spmv", "Time the product of a matrix and a vector, beside Eigen's and the memory's speed.",
       declare_spmv},
      {"manual", "Print this program's manual page.", declare_manual},
  });
  return all;
}

}  // namespace gradpsi::apps
