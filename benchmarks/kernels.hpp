#pragma once

// Loops over plain arrays, compiled for several instruction sets of which the best that runs is taken.
// They know nothing of Eigen, whose alignment depends on the instruction set.

double sum(const double* a, long n);

/// a = b + s c
void triad(const double* b, const double* c, double s, double* a, long n);

/// A matrix in slices of 8 rows, see sell.hpp.
struct SellArrays {
  static constexpr int lanes = 8;
  const int* begin;  // of each slice, in `values`
  const int* columns;
  const double* values;
  const int* row;  // where a row's product goes; -1: nowhere
};
/// The products of slices first to last.
void sell_product(const SellArrays& A, int first, int last, const double* x, double* y);

/// laplacian-mixed-zoc with the quintic Wendland kernel: its neighbours, and the points as one array a
/// coordinate.
struct OnTheFly {
  int dimension;
  const int* offsets;
  const int* indices;
  const double* x[3];
  const double* volumes;
  double support;
  double factor;  // of volume * (1 - r/h)^3
};
/// Rows begin to end of sum_j a_ij (u_j - u_i), without a matrix.
void laplacian(const OnTheFly& points, int begin, int end, const double* u, double* result);
