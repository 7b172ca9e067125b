// Compiled once per W, GRADPSI_LANES; see lanes.hpp.

#include "operators/batch/batch.hpp"

#include "operators/batch/entries.hpp"
#include "operators/batch/high_degree.hpp"
#include "operators/batch/quadratic.hpp"

namespace gradpsi {
namespace {

template <int D, int W>
void high_degree(const BatchSystem& system, const Batch<W>& batch, const Entries<D>* row,
                 Workspace work) {
  switch (system.degree) {
    case 3: return least_squares<D, 3, W>(system, batch, row, work);
    case 4: return least_squares<D, 4, W>(system, batch, row, work);
  }
  if constexpr (highest_batched_degree(D) > 4) switch (system.degree) {
      case 5: return least_squares<D, 5, W>(system, batch, row, work);
      case 6: return least_squares<D, 6, W>(system, batch, row, work);
    }
}

/// Takes the volumes of those beyond the support, and counts who is left.
template <int D, int W>
void leave_out_skin(Entries<D>& row) {
  using V = Lanes<W>;
  V left{};
  for (int k = 0; k < row.padded; k += W) {
    const V volume = load<W>(row.volume + k);
    const auto stays = (load<W>(row.q + k) < 1) & (volume > 0);
    store(row.volume + k, stays ? volume : V{});
    left += stays ? all<W>(1) : V{};
  }
  row.neighbours = static_cast<int>(sum_of_lanes(left));
}

/// Fetches the memory where a row's values go, which is not in any cache: in time for their being written.
[[gnu::always_inline]] inline void fetch(const BatchSystem& system, int entry, int count) {
  for (int o = 0; o < system.outputs; ++o)
    for (int k = 0; k < count; k += 8) __builtin_prefetch(system.values[o] + entry + k, 1, 2);
}

template <int D, int W>
void solve(const BatchPoints& points, const BatchRows& rows, const int* order, int first, int count,
           const BatchSystem* systems, int system_count, int most_entries, double* memory) {
  const long room = round_up(most_entries, 8);
  Entries<D> row[W];
  for (int r = 0; r < W; ++r) {
    double* at = memory + r * (D + 5) * room;
    for (int a = 0; a < D; ++a) row[r].s[a] = at, at += room;
    row[r].q = at, at += room;
    row[r].volume = at, at += room;
    row[r].weight = at, at += room;
    row[r].over = at, at += room;
    row[r].kernel = at;
  }
  const Workspace work{memory + W * (D + 5) * room, room};
  const Profile own = points.profile(0);
  for (int begin = 0; begin < count; begin += W) {
    Batch<W> batch;
    batch.rows = count - begin < W ? count - begin : W;
    batch.first = begin;
    batch.own = own;
    for (int r = 0; r < batch.rows; ++r) {
      const int k = order ? order[begin + r] : first + begin + r;
      batch.row[r] = k;
      batch.entry[r] = rows.outer[k];
      row[r].count = rows.outer[k + 1] - rows.outer[k];
      row[r].padded = round_up(row[r].count, W);
      gather<D>(points, rows.inner + rows.outer[k], rows.points ? rows.points[k] : k, row[r]);
      for (int s = 0; s < system_count; ++s) fetch(systems[s], batch.entry[r], row[r].count);
    }
    // Only now: vector loads of what was stored just before, number by number, would have to wait.
    for (int r = 0; r < batch.rows; ++r) {
      scale<D, W>(points, row[r]);
      row[r].neighbours = row[r].count - 1;
      if (points.have_skin) leave_out_skin<D, W>(row[r]);
      rows.neighbours[begin + r] = row[r].neighbours;
    }
    for (int s = 0; s < system_count; ++s) {
      for (int r = 0; r < batch.rows; ++r) weigh<D, W>(points, systems[s], row[r]);
      if (systems[s].how == How::Given)
        uncorrected<D, W>(systems[s], batch, row, work);
      else if (systems[s].degree <= 2)
        corrected<D, W>(systems[s], batch, row, work);
      else
        high_degree<D, W>(systems[s], batch, row, work);
    }
  }
}

template <int D, int W>
void density(const BatchPoints& points, const int* offsets, const int* indices, const int* order,
             int first, int count, double* volumes) {
  using V = Lanes<W>;
  const double self = points.profile(0).w;
  for (int n = 0; n < count; ++n) {
    const int i = order ? order[n] : first + n;
    const int* const neighbour = indices + offsets[i];
    const int size = offsets[i + 1] - offsets[i];
    const double h = points.supports[points.one_support ? 0 : i];
    const double per_h = 1 / h;
    V sum{};
    for (int k = 0; k < size; k += W) {
      V squared{};
      for (int a = 0; a < D; ++a) {
        V r = all<W>(k + W <= size ? 0 : h);  // whoever fills up the last vector is at q >= 1
        for (int l = 0; l < W && k + l < size; ++l)
          r[l] = points.x[static_cast<long>(neighbour[k + l]) * D + a] -
                 points.x[static_cast<long>(i) * D + a];
        if (points.box[a] > 0) r -= points.box[a] * rounded(r / points.box[a]);
        r *= per_h;
        squared += r * r;
      }
      const V q = square_root(squared);
      V w = profile<W>(points, q < 1 ? q : all<W>(1)).w;
      if (points.have_skin) w = q < 1 ? w : V{};
      if (k + W <= size) {
        sum += w;
      } else {
        for (int l = 0; k + l < size; ++l) sum[l] += w[l];
      }
    }
    volumes[i] = 1 / (self + sum_of_lanes(sum));
  }
}

}  // namespace

template <>
BatchKernels batch_kernels<GRADPSI_LANES>() {
  constexpr int W = GRADPSI_LANES;
  return {{solve<1, W>, solve<2, W>, solve<3, W>}, {density<1, W>, density<2, W>, density<3, W>}};
}

}  // namespace gradpsi
