#pragma once

#include <benchmark/benchmark.h>

#include <functional>
#include <string>
#include <vector>

#include "scenes.hpp"

// Names are data: key:value/key:value, the keys always in the order
// op, impl, scheme (where there is one), dim, n, ratio and grading (if unusual), order, threads.

/// 1, and 2 where there are two cores.
std::vector<int> thread_counts();

using Run = std::function<void(benchmark::State& state, Prepared& scene, int threads)>;

/// Adds a benchmark for each number of threads; `what` is "op:spmv/impl:eigen".
void add(const std::string& what, const Scene& scene, const Run& run,
         const std::vector<int>& threads = thread_counts());
void add_without_scene(const std::string& what,
                       const std::function<void(benchmark::State& state, int threads)>& run);

/// What one iteration does, for the counters ns_per_entry, ns_per_point and GB_per_s; 0: no counter.
struct Work {
  double entries = 0, points = 0;
  double bytes = 0;  ///< that must be read or written, each once
};
void count(benchmark::State& state, const Work& work);
/// .. with the number of neighbours; the points are the scene's.
void count(benchmark::State& state, const Prepared& scene, Work work);

// The families, each for one scene.
void add_roof();
void add_search(const Scene& scene);
void add_spacing(const Scene& scene);  ///< local_spacing() of the points without their volumes
void add_rival_searches(const Scene& scene);
void add_weights(const std::string& scheme, const Scene& scene);
void add_refill(const std::string& scheme, const Scene& scene);
void add_forms(const Scene& scene);   ///< of degree 2, and all of one system in one pass
void add_probes(const Scene& scene);  ///< values between the points
void add_fused_weights(const Scene& scene);
void add_fill(const Scene& scene);

enum class Products {
  Main,     ///< the library's and Eigen's
  ByOrder,  ///< those that an order of the points is judged by
  All
};
void add_products(const Scene& scene, Products products);
void add_gradient_products(const Scene& scene);
void add_vector_products(const Scene& scene);
void add_on_the_fly(const Scene& scene);
