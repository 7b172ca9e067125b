// Any bytes as up to forty points in 1, 2 or 3 dimensions, with any coordinates that a double can hold,
// and as what is asked of them: refused as the interface says, or sound neighbours, volumes and matrices.

#include <algorithm>
#include <array>
#include <gradpsi/gradpsi.hpp>
#include <limits>
#include <optional>

#include "fuzz.hpp"

using namespace gradpsi;

namespace {

/// Choices made of bytes; zeros when there are no more.
class Choices {
 public:
  Choices(const std::uint8_t* data, std::size_t size) : data_(data), rest_(size) {}

  int byte() {
    if (rest_ == 0) return 0;
    --rest_;
    return *data_++;
  }
  int below(int n) { return byte() % n; }
  bool flag() { return (byte() & 1) != 0; }
  double any_double() {
    std::uint64_t bits = 0;
    for (int k = 0; k < 8; ++k) bits = bits << 8 | static_cast<unsigned>(byte());
    return std::bit_cast<double>(bits);
  }

 private:
  const std::uint8_t* data_;
  std::size_t rest_;
};

/// A number near the lattice of spacing `unit`, one of those that are hard, one that was there, or any.
double number(Choices& choices, double unit, const std::vector<double>& before) {
  using Limits = std::numeric_limits<double>;
  static constexpr std::array special = {0.0,
                                         -0.0,
                                         Limits::denorm_min(),
                                         Limits::min(),
                                         -Limits::min(),
                                         Limits::max(),
                                         -Limits::max(),
                                         Limits::infinity(),
                                         Limits::quiet_NaN(),
                                         Limits::epsilon(),
                                         1 + Limits::epsilon(),
                                         1e8,
                                         1e154,
                                         1e200,
                                         1e-154,
                                         1e-200};
  switch (const int kind = choices.byte(); kind >> 5) {
    case 0: return special[kind & 15];
    case 1: return choices.any_double();
    case 2:
      if (!before.empty()) return before[choices.byte() % before.size()];
      [[fallthrough]];
    case 3: return unit * ((kind & 31) - 16 + choices.byte() / 256.0);  // jittered
    default: return unit * ((kind & 15) - 8);                           // the lattice itself
  }
}

struct Case {
  Positions positions = {};
  CloudOptions cloud = {};
  Eigen::VectorXd supports = {};
  Scheme scheme;
  AssemblyOptions assembly = {};
};

Case decoded(Choices& choices) {
  Case c{.scheme = schemes()[choices.byte() % schemes().size()]};
  const int d = 1 + choices.below(3);
  // Up to 40 points, enough for most schemes in 3D; mostly few, whose runs take a fifth of the time.
  const int size = choices.byte(), n = size <= 40 ? size : size % 13;
  const double unit = std::ldexp(1.0, choices.flag() ? 8 * (choices.byte() - 128) : 0);
  c.assembly.kernel = kernels()[choices.byte() % kernels().size()];
  c.assembly.on_degenerate = static_cast<OnDegenerate>(choices.below(4));
  c.assembly.threads = 1;
  const int has = choices.byte();
  std::vector<double> before;
  if (has & 1)
    for (int a = 0; a < d; ++a) c.cloud.box[a] = number(choices, unit, before);
  const Eigen::Index count = has & 2 ? n : 1;
  c.supports.resize(count);
  for (double& h : c.supports) h = std::abs(number(choices, unit, before));
  c.positions.resize(n, d);
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < d; ++a) before.push_back(c.positions(i, a) = number(choices, unit, before));
  if (has & 4) {
    c.cloud.volumes.resize(n);
    for (double& v : c.cloud.volumes) v = std::abs(number(choices, unit, {}));
  }
  if (has & 8) {
    c.assembly.rows.emplace();
    for (int k = choices.below(41); k > 0; --k) c.assembly.rows->push_back(choices.byte() % 48);
  }
  return c;
}

void require_neighbours(const Cloud& cloud, const Neighbours& near) {
  const int n = cloud.size();
  require(near.size() == n && near.offsets[0] == 0 && near.offsets[n] == near.indices.size(),
          "each point has its neighbours");
  const bool open = cloud.box() == std::array<double, 3>{};
  for (int i = 0; i < n; ++i) {
    const auto of = near.of(i);
    require(std::ranges::adjacent_find(of, std::ranges::greater_equal()) == of.end(),
            "neighbours ascend");
    for (const int j : of) require(j >= 0 && j < n && j != i, "neighbours are other points");
    for (int j = 0; open && j < n; ++j) {
      if (j == i) continue;
      long double squared = 0;  // x87: neither overflows nor vanishes
      for (int a = 0; a < cloud.dimension(); ++a) {
        const long double r = static_cast<long double>(cloud.positions()(j, a)) -
                              static_cast<long double>(cloud.positions()(i, a));
        squared += r * r;
      }
      const long double q = std::sqrt(squared) / near.support(i);
      const bool found = std::ranges::binary_search(of, j);
      require(found ? q < 1 + 1e-14L : q > 1 - 1e-14L, "neighbours are those within the support");
    }
  }
}

/// Row k of a matrix, of point i.
void require_row(const SparseMatrix& matrix, int k, int i, const Scheme& scheme,
                 RowOutcome outcome) {
  const bool is_value = scheme.derivative == Derivative::Value && outcome != RowOutcome::Zero;
  const long double sign = scheme.consistency == Consistency::Symmetric ? -1 : 1;
  long double sum = is_value ? -1 : 0, magnitude = is_value ? 1 : 0;
  bool has_diagonal = false;
  for (int e = matrix.outerIndexPtr()[k]; e < matrix.outerIndexPtr()[k + 1]; ++e) {
    const int j = matrix.innerIndexPtr()[e];
    const double a = matrix.valuePtr()[e];
    require(j >= 0 && j < matrix.cols(), "columns are in range");
    require(e == matrix.outerIndexPtr()[k] || matrix.innerIndexPtr()[e - 1] < j, "columns ascend");
    require(std::isfinite(a), "entries are finite");
    require(outcome != RowOutcome::Zero || a == 0, "a zero row holds zeros");
    require(scheme.consistency != Consistency::Positive || j == i || a >= 0,
            "positive stencils are positive");
    has_diagonal |= j == i;
    sum += j == i ? sign * a : a;
    magnitude += std::abs(static_cast<long double>(a));
  }
  require(has_diagonal, "each row has its diagonal");
  // Rounding: the diagonal is the sum of up to 40 others; the last digit may be a denormal's.
  require(std::abs(sum) <= 1e-14L * magnitude + 1e-320L, "rows sum to what they should");
}

void require_operator(const Case& c, const Cloud& cloud, const Neighbours& near,
                      const Operator& op) {
  const int n = cloud.size();
  const int m = c.assembly.rows ? static_cast<int>(c.assembly.rows->size()) : n;
  require(op.axes.size() == components(c.scheme.derivative, cloud.dimension()).size(),
          "a matrix for each component");
  require(op.volumes.size() == n, "each point has a volume");
  for (const double v : op.volumes) require(v > 0 && std::isfinite(v), "volumes are positive");
  const RowReport& rows = op.rows;
  require(rows.neighbours.size() == m && rows.supports.size() == m &&
              rows.reciprocal_condition.size() == m && std::ssize(rows.outcome) == m &&
              rows.degree.size() == m,
          "each row is reported");
  for (const SparseMatrix& matrix : op.axes)
    require(matrix.rows() == m && matrix.cols() == n && matrix.isCompressed() &&
                matrix.outerIndexPtr()[m] == matrix.nonZeros(),
            "matrices have the size asked for");

  const OnDegenerate policy = c.assembly.on_degenerate;
  for (int k = 0; k < m; ++k) {
    const int i = c.assembly.rows ? (*c.assembly.rows)[k] : k;
    const RowOutcome outcome = rows.outcome[k];
    require(outcome == RowOutcome::AsAsked ||
                (outcome == RowOutcome::Lowered && policy == OnDegenerate::Lower) ||
                (outcome == RowOutcome::Widened && policy == OnDegenerate::Widen) ||
                (outcome == RowOutcome::Zero && policy != OnDegenerate::Fail),
            "rows come about as the policy allows");
    const bool widened = outcome == RowOutcome::Widened;
    require(rows.degree[k] == -1
                ? outcome == RowOutcome::Zero || degree(c.scheme) == -1
                : rows.degree[k] <= degree(c.scheme) &&
                      (outcome == RowOutcome::Lowered || rows.degree[k] == degree(c.scheme)),
            "degrees go with outcomes");
    const bool alone = reach(c.scheme) == 1;  // or made of its neighbours' rows, too
    require(widened
                ? !alone || (rows.supports[k] > near.support(i) && std::isfinite(rows.supports[k]))
                : rows.supports[k] == near.support(i),
            "supports are those used");
    require(widened || !alone ? rows.neighbours[k] >= near.count(i)
                              : rows.neighbours[k] == near.count(i),
            "neighbours are counted");
    require(rows.reciprocal_condition[k] >= 0 && rows.reciprocal_condition[k] <= 1 + 1e-12,
            "a reciprocal condition number is between 0 and 1");
    for (const SparseMatrix& matrix : op.axes) {
      require_row(matrix, k, i, c.scheme, outcome);
      const int entries = matrix.outerIndexPtr()[k + 1] - matrix.outerIndexPtr()[k];
      require(c.scheme.consistency == Consistency::Positive ? entries <= rows.neighbours[k] + 1
                                                            : entries == rows.neighbours[k] + 1,
              "as many entries as neighbours, and the diagonal");
    }
  }
}

void require_reassembled(const Case& c, const Cloud& cloud, const Neighbours& near,
                         const Operator& op) {
  if (c.scheme.consistency == Consistency::Positive || reach(c.scheme) > 1 ||
      c.assembly.on_degenerate == OnDegenerate::Widen)
    return;
  Operator again = op;
  for (SparseMatrix& matrix : again.axes) std::fill_n(matrix.valuePtr(), matrix.nonZeros(), -7.0);
  reassemble(c.scheme, cloud, near, again, c.assembly);
  for (std::size_t a = 0; a < op.axes.size(); ++a)
    require(std::equal(op.axes[a].valuePtr(), op.axes[a].valuePtr() + op.axes[a].nonZeros(),
                       again.axes[a].valuePtr()),
            "reassembled values are the same");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Choices choices(data, size);
  const Case c = decoded(choices);
  try {
    const Cloud cloud(c.positions, c.cloud);
    const Neighbours near = find_neighbours(cloud, c.supports, 1);
    require_neighbours(cloud, near);
    const Operator op = assemble(c.scheme, cloud, near, c.assembly);
    require_operator(c, cloud, near, op);
    require_reassembled(c, cloud, near, op);
  } catch (const InvalidInput&) {
  } catch (const StencilError& error) {
    require(c.assembly.on_degenerate == OnDegenerate::Fail, "only that policy fails");
    require(error.point >= 0 && error.point < c.positions.rows(), "the error names a point");
  }
  return 0;
}
