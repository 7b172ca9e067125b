// What implicit diffusion gets right, and how well.
//
//     gradpsi_diffusion_study [--quick]
//
// prints a CSV.
// - time, space: orders on decaying modes of the unit interval, square and cube, u = sin(pi x) .. between
//   walls held at 0, u = cos(pi x) .. between walls without flux. Expect order 1 in time from backward
//   Euler and 2 from Crank-Nicolson; in space none without correction and 2 with second-order consistency.
// - poisson: lap u = f on the unit square, 40 x 40 points, the outermost fixed.
// - slab: the temperature where conductivities 1 and 10 meet, by the harmonic and the arithmetic mean.

#include <exception>
#include <iostream>
#include <string_view>

#include "studies/diffusion.hpp"

namespace {

using namespace gradpsi::apps;
using namespace gradpsi::apps::diffusion;

void print(const std::vector<Result>& results) {
  std::cout << csv_lines(columns(), results) << std::flush;
}

void study(bool quick) {
  std::cout << csv_heading(columns());
  for (const int dimension : {1, 2, 3})
    for (const Walls walls : {Walls::Fixed, Walls::NoFlux}) {
      print(time_orders(dimension, walls, quick));
      for (const char* scheme : {"laplacian-mixed-zoc", "laplacian-mixed-soc"})
        for (const double jitter : {0.0, 0.2})
          print(space_orders(dimension, walls, jitter, scheme, quick));
    }
  for (const char* scheme : {"laplacian-mixed-zoc", "laplacian-mixed-soc"}) {
    for (const double support_ratio : {2.5, 3.5}) print({poisson(scheme, support_ratio)});
    for (const double jitter : {0.0, 0.2})
      for (const auto mean : {gradpsi::Mean::Harmonic, gradpsi::Mean::Arithmetic})
        print({slab(scheme, jitter, mean)});
  }
}

}  // namespace

int main(int argc, char** argv) try {
  const bool quick = argc == 2 && std::string_view(argv[1]) == "--quick";
  if (argc > 1 && !quick) {
    std::cerr << "Usage: " << argv[0] << " [--quick]\n";
    return 2;
  }
  study(quick);
} catch (const std::exception& error) {
  std::cerr << "error: " << error.what() << '\n';
  return 1;
}
