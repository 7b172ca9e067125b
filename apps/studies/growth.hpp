#pragma once

#include <complex>
#include <gradpsi/scheme.hpp>
#include <string>
#include <vector>

// A scheme whose solutions of du/dt = lap u grow and one whose do not, on the same points, walls held:
// eigenvalues, and what fields become by explicit and by implicit steps.

namespace gradpsi::apps::growth {

/// An eigenvalue times dx^2.
struct Eigenvalue {
  Scheme scheme;
  std::complex<double> value;
};

/// A field after some steps.
struct Moment {
  double time, largest;  ///< the field's largest value
};

/// How a field goes.
struct History {
  Scheme scheme;
  const char* stepper;  ///< explicit or implicit
  double step;
  std::vector<Moment> moments;  ///< as long as values stay below 1e12
  double last;                  ///< the largest value after the last step
};

struct Results {
  std::vector<Eigenvalue> eigenvalues;
  std::vector<History> histories;
};
Results results();

/// rk4_region.csv: the edge of the region where RK4 does not amplify, by rays from z = -1.
std::string rk4_region_csv();

/// spectra.csv
std::string spectra_csv(const Results& results);

/// history.csv
std::string history_csv(const Results& results);

/// What became of the fields; for people.
std::string summary(const Results& results);

}  // namespace gradpsi::apps::growth
