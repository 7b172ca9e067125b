#pragma once

#include <span>

#include "batch.hpp"
#include "candidates.hpp"
#include "gradpsi/assemble.hpp"
#include "products.hpp"

namespace gradpsi {

/// The vector code for one kind of processor.
struct Simd {
  const char* name;  // "sse2", "avx2", "avx512"
  BatchKernels batch;
  CandidateKernels candidates;
  ProductKernels products;
};

/// What this processor can run, plainest first.
std::span<const Simd> runnable_simd();

/// The best for this processor.
const Simd& simd();

/// assemble() with that vector code. Null: every row by itself, which is slow and the reference.
std::vector<Operator> assemble_with(const Simd* vector_code, const std::vector<Scheme>& schemes,
                                    const Cloud& cloud, const Neighbours& near,
                                    const AssemblyOptions& options);

/// The arguments' arrays, as the vector code wants them.
BatchPoints batch_points(const Cloud& cloud, const Neighbours& near, const Kernel& kernel,
                         const Eigen::VectorXd& volumes);

}  // namespace gradpsi
