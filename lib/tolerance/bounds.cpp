// Compiled once per W, GRADPSI_LANES; see lanes.hpp.

#include "tolerance/bounds.hpp"

#include <numbers>

#include "base/lanes.hpp"

namespace gradpsi {
namespace {

constexpr int W = GRADPSI_LANES;
using V = Lanes<W>;
using Mask = decltype(V{} < V{});

constexpr double small = 0.02;      // of the rest: what needs not be known better
constexpr double beyond_doubt = 4;  // times the tolerance
constexpr double eps = 0x1p-52;

bool any(Mask mask) {
  bool result = false;
  for (int l = 0; l < W; ++l) result |= mask[l] != 0;
  return result;
}
V magnitude(V x) { return x < 0 ? -x : x; }

/// W rows. Frozen lanes keep their numbers.
template <int D>
struct Series {
  const BoundTables& tables;
  int count = 0;      // entries of the longest row
  double* powers[D];  // s_a^p / p! of all entries, one p after the other
  double* weights[most_components];
  double *lengths, *sizes;        // |s|, |s|^m / m!
  double* defects[most_degrees];  // monomials x outputs
  V largest[most_degrees];        // by degree: a bound of the magnitude in any direction
  V wavenumbers;
  V counts;  // entries of each row
  // Sums of magnitudes: of entries, of what degrees beyond add, of lost digits.
  V entries, beyond, rounding;

  Series(const BoundTables& tables, int most_entries, double* memory) : tables(tables) {
    const auto take = [&](long numbers) {
      double* const at = memory;
      memory += W * numbers;
      return at;
    };
    for (int a = 0; a < D; ++a) powers[a] = take(most_entries * (tables.highest + 1L));
    for (int o = 0; o < tables.outputs; ++o) weights[o] = take(most_entries);
    lengths = take(most_entries);
    sizes = take(most_entries);
    for (int m = 0; m <= tables.highest; ++m)
      defects[m] = take(static_cast<long>(tables.degrees[m].count) * tables.outputs);
  }

  double* power(int a, int p) { return powers[a] + static_cast<long>(W) * p * count; }
  const DegreeTable& degree(int m) const { return tables.degrees[m]; }

  void gather(const BoundRows& op, const int* rows, int in_use);
  void scale(const BoundRows& op);
  V all_sizes() const;
  void next_degree(int m, Mask going);
  V series(int degrees) const;
  V worst_direction(int m) const;
  V bound(double tolerance);
};

/// Copies W rows together, r_ij and weights as they are; those that are not `in_use` are empty.
template <int D>
void Series<D>::gather(const BoundRows& op, const int* rows, int in_use) {
  count = 0;
  for (int r = 0; r < in_use; ++r) {
    const int own = op.outer[rows[r] + 1] - op.outer[rows[r]];
    count = own > count ? own : count;
  }
  wavenumbers = all<W>(1);
  counts = V{};
  for (int r = 0; r < W; ++r) {
    int begin = 0, own = 0;
    long i = 0;
    if (r < in_use) {
      begin = op.outer[rows[r]];
      own = op.outer[rows[r] + 1] - begin;
      i = op.points ? op.points[rows[r]] : rows[r];
      wavenumbers[r] = 2 * std::numbers::pi / op.wavelengths[op.one_wavelength ? 0 : i];
      counts[r] = own;
    }
    for (int e = 0; e < count; ++e) {
      const long to = static_cast<long>(e) * W + r, j = e < own ? op.inner[begin + e] : i;
      for (int a = 0; a < D; ++a) power(a, 1)[to] = op.x[j * D + a] - op.x[i * D + a];
      for (int o = 0; o < tables.outputs; ++o)
        weights[o][to] = e < own ? op.values[o][begin + e] : 0;
    }
  }
}

/// To units of the wavenumber.
template <int D>
void Series<D>::scale(const BoundRows& op) {
  V unit = all<W>(1);
  for (int q = 0; q < tables.order; ++q) unit /= wavenumbers;
  for (long e = 0; e < static_cast<long>(W) * count; e += W) {
    V squares{};
    for (int a = 0; a < D; ++a) {
      V s = load<W>(power(a, 1) + e);
      if (op.box[a] > 0) s -= op.box[a] * rounded(s / op.box[a]);
      s *= wavenumbers;
      store(power(a, 0) + e, all<W>(1));
      store(power(a, 1) + e, s);
      squares += s * s;
    }
    for (int o = 0; o < tables.outputs; ++o) store(weights[o] + e, load<W>(weights[o] + e) * unit);
    store(lengths + e, square_root(squares));
    store(sizes + e, all<W>(1));
  }
  for (V& each : largest) each = V{};
  entries = beyond = all_sizes();
  rounding = V{};
}

/// sum_j |a_ij| |s|^m / m!, of all outputs.
template <int D>
V Series<D>::all_sizes() const {
  V sums[most_components], most{};
  for (int o = 0; o < tables.outputs; ++o) {
    V sum{};
    for (long e = 0; e < static_cast<long>(W) * count; e += W)
      sum += magnitude(load<W>(weights[o] + e)) * load<W>(sizes + e);
    sums[o] = sum;
    most = sum > most ? sum : most;
  }
  if (tables.outputs == 1) return sums[0];
  V squares{};  // in units of the largest: they may be beyond a double
  for (int o = 0; o < tables.outputs; ++o) {
    const V part = sums[o] / (most > 0 ? most : all<W>(1));
    squares += part * part;
  }
  return most * square_root(squares);
}

/// The moments of degree m less what the target makes of them, and what the degrees beyond can add.
template <int D>
void Series<D>::next_degree(int m, Mask going) {
  const long all_entries = static_cast<long>(W) * count;
  if (m > 1)
    for (int a = 0; a < D; ++a) {
      double *const last = power(a, m - 1), *const next = power(a, m), *const s = power(a, 1);
      for (long e = 0; e < all_entries; e += W)
        store(next + e, load<W>(last + e) * load<W>(s + e) * (1.0 / m));
    }
  V squares{};
  double* defect = defects[m];
  const double* asked = degree(m).asked;
  for (int c = 0; c < degree(m).count; ++c) {
    const Monomial& monomial = degree(m).monomials[c];
    const double* factors[D];
    for (int a = 0; a < D; ++a) factors[a] = power(a, monomial.powers[a]);
    for (int o = 0; o < tables.outputs; ++o, defect += W) {
      V moment{};
      for (long e = 0; e < all_entries; e += W) {
        V product = load<W>(weights[o] + e);
        for (int a = 0; a < D; ++a) product *= load<W>(factors[a] + e);
        moment += product;
      }
      const V off = moment - *asked++ / monomial.factorial;
      store(defect, off);
      squares += off * off * monomial.factorial;
    }
  }
  // The Frobenius norm of the tensor.
  largest[m] = going ? square_root(squares / degree(m).factorial) : V{};
  rounding = going ? rounding + (counts + (m + 4)) * eps * beyond : rounding;
  for (long e = 0; e < all_entries; e += W)
    store(sizes + e, load<W>(sizes + e) * load<W>(lengths + e) * (1.0 / (m + 1)));
  beyond = going ? all_sizes() : beyond;
}

/// Of the degrees 0 to `degrees`, real and imaginary parts.
template <int D>
V Series<D>::series(int degrees) const {
  V parts[2] = {};
  for (int m = 0; m <= degrees; ++m) parts[m % 2] += largest[m];
  return square_root(parts[0] * parts[0] + parts[1] * parts[1]);
}

template <int D>
V Series<D>::worst_direction(int m) const {
  constexpr int block = 4;
  const int count = degree(m).count, outputs = tables.outputs;
  V worst{};
  for (int first = 0; first < tables.directions; first += block) {
    const double* at[block];  // some twice at the end
    for (int b = 0; b < block; ++b) {
      const int direction = first + b < tables.directions ? first + b : first;
      at[b] = degree(m).at_directions + static_cast<long>(direction) * count;
    }
    V squares[block] = {};
    for (int o = 0; o < outputs; ++o) {
      V sums[block] = {};
      for (int c = 0; c < count; ++c) {
        const V defect = load<W>(defects[m] + static_cast<long>(W) * (c * outputs + o));
        for (int b = 0; b < block; ++b) sums[b] += at[b][c] * defect;
      }
      for (int b = 0; b < block; ++b) squares[b] += sums[b] * sums[b];
    }
    for (int b = 0; b < block; ++b) worst = squares[b] > worst ? squares[b] : worst;
  }
  return square_root(worst) * degree(m).slack;
}

template <int D>
V Series<D>::bound(double tolerance) {
  const auto misses = [&](V bound) -> Mask {
    return tolerance > 0 ? bound > beyond_doubt * tolerance : Mask{};
  };
  Mask going = ~Mask{};
  int m = 0;
  next_degree(m, going);
  while (m < tables.highest) {
    if (m > tables.order) going &= ~misses(series(m)) & (beyond > small * series(m));
    if (!any(going)) break;
    next_degree(++m, going);
  }
  const V all_degrees = series(m), others = beyond + rounding;
  // No wave makes more of a row than its entries add up to, nor of the derivative than 1.
  const V most = entries + 1;
  const Mask counts = ~misses(all_degrees + others);
  if (any(counts))
    for (int k = 1; k <= m; ++k) {
      const Mask matters = counts & (largest[k] > small * all_degrees);
      if (degree(k).slack > 2 || !any(matters)) continue;
      const V worst = worst_direction(k);
      largest[k] = matters & (worst < largest[k]) ? worst : largest[k];
    }
  const V result = series(m) + others;
  return result < most ? result : most;
}

template <int D>
void bounds(const BoundTables& tables, const BoundRows& op, const int* rows, int count,
            int most_entries, double* errors, double* memory) {
  Series<D> series(tables, most_entries, memory);
  for (int begin = 0; begin < count; begin += W) {
    const int in_use = count - begin < W ? count - begin : W;
    series.gather(op, rows + begin, in_use);
    series.scale(op);
    const V found = series.bound(op.tolerance);
    for (int r = 0; r < in_use; ++r) errors[rows[begin + r]] = found[r];
  }
}

}  // namespace

template <>
BoundKernels bound_kernels<GRADPSI_LANES>() {
  return {{bounds<1>, bounds<2>, bounds<3>}};
}

}  // namespace gradpsi
