#include "operators/fill.hpp"

#include <algorithm>
#include <type_traits>

#include "base/dispatch.hpp"
#include "base/memory.hpp"
#include "base/parallel.hpp"
#include "operators/batch/points.hpp"
#include "operators/degenerate.hpp"
#include "operators/row.hpp"
#include "operators/surface.hpp"
#include "search/within.hpp"

namespace gradpsi {
namespace {

constexpr int rows_per_chunk = 512;

/// What a thread needs to compute rows; a copy has memory of its own.
template <int D, class AnyRow = Row<D>>
class RowWorker {
 public:
  RowWorker(const Cpu* cpu, const std::vector<Request>& requests, const Cloud& cloud,
            const Neighbours& near, const DenseVector& volumes, const ChosenRows& rows,
            const AssemblyOptions& options)
      : cpu_(cpu),
        requests_(requests),
        cloud_(cloud),
        near_(near),
        volumes_(volumes),
        rows_(rows),
        // Points that are near one another in turn, so that what they share is still in the cache.
        order_(rows.chosen || near.order.size() == 0 ? nullptr : near.order.data()),
        points_(batch_points(cloud, near, options.kernel, volumes)),
        plan_(cpu ? plan(requests, D) : Plan{{}, std::vector<int>(requests.size(), -1)}),
        solved_(plan_.systems.size() * rows_per_chunk),
        neighbours_(rows_per_chunk),
        alone_(options.kernel) {
    const SparseMatrix& pattern = requests.front().op->axes.front();
    pattern_ = {pattern.outerIndexPtr(), pattern.innerIndexPtr(),
                rows.chosen ? rows.chosen->data() : nullptr, nullptr};
  }

  /// Computes up to rows_per_chunk rows of all requests, and their reports.
  void operator()(int begin, int end) {
    solve_together(begin, end);
    for (std::size_t r = 0; r < requests_.size(); ++r)
      for (int n = begin; n < end; ++n) report(static_cast<int>(r), row(n), n - begin);
  }

 private:
  int row(int n) const { return order_ ? order_[n] : n; }

  void solve_together(int begin, int end) {
    if (plan_.systems.empty()) return;
    int most = 0;
    for (int n = begin; n < end; ++n)
      most = std::max(most, pattern_.outer[row(n) + 1] - pattern_.outer[row(n)]);
    pattern_.neighbours = neighbours_.data();  // this copy's
    int outputs = 0;
    for (std::size_t s = 0; s < plan_.systems.size(); ++s) {
      plan_.systems[s].solved = solved_.data() + s * rows_per_chunk;
      outputs = std::max(outputs, plan_.systems[s].outputs);
    }
    batch_kernels(*cpu_).solve[D - 1](points_, pattern_, order_ ? order_ + begin : nullptr, begin,
                                      end - begin, plan_.systems.data(),
                                      static_cast<int>(plan_.systems.size()), most,
                                      memory_.doubles(batch_memory(D, most, outputs)));
  }

  /// Reports row k of request r, the chunk's n-th; computes it by itself if that has not been done.
  void report(int r, int k, int n) {
    const Request& request = requests_[r];
    RowReport& report = request.op->rows;
    const int i = rows_.point(k), s = plan_.of_request[r];
    report.supports[k] = near_.support(i);
    if (s >= 0 && solved_[s * rows_per_chunk + n]) {
      report.neighbours[k] = neighbours_[n];
      report.reciprocal_condition[k] = plan_.systems[s].reciprocal_condition[k];
      report.outcome[k] = RowOutcome::AsAsked;
      report.degree[k] = request.steps.front().exact;
    } else {
      solve_alone(request, i, k);
    }
  }

  void solve_alone(const Request& request, int i, int k) {
    const auto neighbours = within_support(cloud_, near_, i, within_);
    request.op->rows.neighbours[k] = static_cast<int>(neighbours.size());
    alone_.gather(cloud_, neighbours, near_.support(i), volumes_, i);
    solve_row(alone_, request.steps, request.op->rows, k);
    for (std::size_t o = 0; o < request.op->axes.size(); ++o)
      write_alone(neighbours, i, static_cast<int>(o), k,
                  request.op->axes[o].valuePtr() + pattern_.outer[k]);
    if constexpr (std::is_same_v<AnyRow, SurfaceRow>) request.op->normals.row(k) = alone_.normal();
  }

  /// Writes what has been solved alone in its row's places; points in the skin get 0.
  void write_alone(std::span<const int> neighbours, int i, int output, int k, double* entry) {
    if (std::ssize(neighbours) == near_.count(i)) return alone_.write(neighbours, i, output, entry);
    own_.resize(neighbours.size() + 1);
    alone_.write(neighbours, i, output, own_.data());
    const double* a = own_.data();
    auto next = neighbours.begin();
    for (int l = pattern_.outer[k]; l < pattern_.outer[k + 1]; ++l) {
      const int j = pattern_.inner[l];
      const bool is_neighbour = next != neighbours.end() && *next == j;
      next += is_neighbour;
      *entry++ = is_neighbour || j == i ? *a++ : 0;
    }
  }

  const Cpu* cpu_;
  const std::vector<Request>& requests_;
  const Cloud& cloud_;
  const Neighbours& near_;
  const DenseVector& volumes_;
  ChosenRows rows_;
  const int* order_;
  BatchPoints points_;
  BatchRows pattern_;
  Plan plan_;
  std::vector<unsigned char> solved_;  // by system, of the chunk's rows
  std::vector<int> neighbours_;        // with a weight, of the chunk's rows
  std::vector<int> within_;            // of one row, its neighbours
  std::vector<double> own_;            // and entries
  AnyRow alone_;
  LaneMemory memory_;
};

}  // namespace

void fill(const Cpu* cpu, const std::vector<Request>& requests, const Cloud& cloud,
          const Neighbours& near, const DenseVector& volumes, const ChosenRows& rows,
          const AssemblyOptions& options) {
  if (on_surface(cloud, options))
    return parallel_chunks(
        rows.count, rows_per_chunk, options.threads,
        RowWorker<3, SurfaceRow>(nullptr, requests, cloud, near, volumes, rows, options));
  dispatch(cloud.dimension(), [&](auto d) {
    parallel_chunks(rows.count, rows_per_chunk, options.threads,
                    RowWorker<d>(cpu, requests, cloud, near, volumes, rows, options));
  });
}

}  // namespace gradpsi
