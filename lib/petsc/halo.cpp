#include "petsc/halo.hpp"

#include <algorithm>
#include <array>
#include <cfloat>
#include <map>

#include "petsc/collective.hpp"

namespace gradpsi::petsc {
namespace {

constexpr double rounding = 4 * DBL_EPSILON;  // of a coordinate and a distance added up

/// A box for each image of the cloud, 3^d of them, of what is looked for: low and high corner.
class Boxes {
 public:
  static int count(int dimension) { return dimension == 1 ? 3 : dimension == 2 ? 9 : 27; }
  static int size(int dimension) { return 2 * dimension * count(dimension); }

  explicit Boxes(int dimension) : d_(dimension), corners_(size(dimension)) {
    for (int b = 0; b < count(d_); ++b)
      for (int a = 0; a < d_; ++a) low(b)[a] = DBL_MAX, high(b)[a] = -DBL_MAX;
  }
  const std::vector<double>& corners() const { return corners_; }

  void extend(int b, const double* from, const double* to) {
    for (int a = 0; a < d_; ++a) {
      low(b)[a] = std::min(low(b)[a], from[a]);
      high(b)[a] = std::max(high(b)[a], to[a]);
    }
  }

 private:
  double* low(int b) { return corners_.data() + std::ptrdiff_t{2} * d_ * b; }
  double* high(int b) { return low(b) + d_; }

  int d_;
  std::vector<double> corners_;
};

}  // namespace

/// What each process asks of others: their points in boxes around its own.
struct HaloSearch {
  static std::map<int, Boxes> requests(const Partition& partition, const Positions& x,
                                       const VectorView& reach);
};

std::map<int, Boxes> HaloSearch::requests(const Partition& partition, const Positions& x,
                                          const VectorView& reach) {
  std::map<int, Boxes> result;
  const Cloud& own = partition.cloud();
  const int d = own.dimension();
  std::vector<int> owners;
  std::array<double, 3> low, high, shifted_low, shifted_high;
  for (int i = 0; i < own.size(); ++i) {
    const double r = reach[reach.size() == 1 ? 0 : i];
    for (int a = 0; a < d; ++a) {
      const double more = r + rounding * (partition.largest_ + own.box()[a] + r);
      low[a] = x(i, a) - more;
      high[a] = x(i, a) + more;
    }
    if (partition.is_inside(low.data(), high.data())) continue;
    for (int image = 0; image < Boxes::count(d); ++image) {
      bool meets = true;
      for (int a = 0, rest = image; a < d; ++a, rest /= 3) {
        const double length = own.box()[a], shift = (rest % 3 - 1) * length;
        shifted_low[a] = low[a] + shift;
        shifted_high[a] = high[a] + shift;
        if (length == 0)
          meets &= rest % 3 == 1;
        else
          meets &= shifted_high[a] >= 0 && shifted_low[a] <= length;
      }
      if (!meets) continue;
      partition.owners_of(shifted_low.data(), shifted_high.data(), owners);
      for (const int q : owners)
        result.try_emplace(q, d).first->second.extend(image, shifted_low.data(),
                                                      shifted_high.data());
    }
  }
  return result;
}

namespace {

/// Own points in one of the boxes that a process asked for: place and number of each.
std::vector<std::int64_t> answer(const Cloud& own, const Positions& x, const double* boxes) {
  const int d = own.dimension();
  std::vector<const double*> asked;  // low corner, then high corner
  for (int b = 0; b < Boxes::count(d); ++b)
    if (const double* const box = boxes + std::ptrdiff_t{2} * d * b; box[0] <= box[d])
      asked.push_back(box);
  std::vector<std::int64_t> found;
  for (int i = 0; i < own.size(); ++i)
    for (const double* const box : asked) {
      bool in = true;
      for (int a = 0; a < d; ++a) in &= box[a] <= x(i, a) && x(i, a) <= box[d + a];
      if (!in) continue;
      found.push_back(i);
      found.push_back(own.number(i));
      break;
    }
  return found;
}

}  // namespace

std::vector<Outsider> halo(const Partition& partition, const Positions& x,
                           const VectorView& reach) {
  MPI_Comm comm;
  PetscMPIInt tag;
  check(PetscCommDuplicate(partition.comm(), &comm, &tag));
  std::vector<PetscMPIInt> to;
  std::vector<double> boxes;
  std::map<int, Boxes> asks;
  together(comm, [&] { asks = HaloSearch::requests(partition, x, reach); });
  for (const auto& [rank, asked] : asks) {
    to.push_back(rank);
    boxes.insert(boxes.end(), asked.corners().begin(), asked.corners().end());
  }
  const int size = Boxes::size(partition.cloud().dimension());
  PetscMPIInt askers, *asker_ranks;
  double* asked;
  check(PetscCommBuildTwoSided(comm, size, MPI_DOUBLE, static_cast<PetscMPIInt>(to.size()),
                               to.data(), boxes.data(), &askers, &asker_ranks, &asked));
  std::vector<std::vector<std::int64_t>> answers;
  std::vector<MPI_Request> sent(askers);
  for (int k = 0; k < askers; ++k) {
    answers.push_back(answer(partition.cloud(), x, asked + std::ptrdiff_t{size} * k));
    MPI_Isend(answers[k].data(), static_cast<int>(answers[k].size()), MPI_INT64_T, asker_ranks[k],
              tag, comm, &sent[k]);
  }
  std::vector<Outsider> result;
  for (const int q : to) {
    MPI_Status status;
    MPI_Probe(q, tag, comm, &status);
    int count;
    MPI_Get_count(&status, MPI_INT64_T, &count);
    std::vector<std::int64_t> got(count);
    MPI_Recv(got.data(), count, MPI_INT64_T, q, tag, comm, MPI_STATUS_IGNORE);
    for (int k = 0; k < count; k += 2)
      result.push_back({got[k + 1], {q, static_cast<PetscInt>(got[k])}});
  }
  MPI_Waitall(askers, sent.data(), MPI_STATUSES_IGNORE);
  check(PetscFree(asker_ranks));
  check(PetscFree(asked));
  check(PetscCommDestroy(&comm));
  std::ranges::sort(result, {}, &Outsider::number);
  return result;
}

}  // namespace gradpsi::petsc
