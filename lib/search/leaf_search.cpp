#include "search/leaf_search.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace gradpsi {
namespace {

constexpr int few = 64;  // measured: beyond, nth_element() is faster
constexpr double infinity = std::numeric_limits<double>::infinity();

/// Calls visit(shift) for every combination of -length, 0, +length in the periodic directions.
template <int D, class Visit>
void for_each_image(const Point<D>& box, const Visit& visit) {
  Point<D> shift;
  const auto loop = [&](auto&& self, int a) -> void {
    if (a == D) return visit(shift);
    for (const int k : {-1, 0, 1}) {
      if (k != 0 && box[a] == 0) continue;
      shift[a] = k * box[a];
      self(self, a + 1);
    }
  };
  loop(loop, 0);
}

/// The box of a leaf's points, widened.
template <int D>
Box<D> box_around(const Tree<D>& tree, Leaf leaf, double reach) {
  Box<D> box{tree.point(leaf.begin), tree.point(leaf.begin)};
  for (int a = 0; a < D; ++a) {
    const double* const x = tree.points().x[a].data();
    for (int k = leaf.begin; k < leaf.end; ++k) {
      box.low[a] = std::min(box.low[a], x[k]);
      box.high[a] = std::max(box.high[a], x[k]);
    }
    box.low[a] -= reach, box.high[a] += reach;
  }
  return box;
}

}  // namespace

double ranked(std::vector<double>& values, int rank) {
  static const RankedFunction of_few = candidate_kernels(cpu()).ranked;
  const auto size = std::ssize(values);
  if (size < rank) return infinity;
  if (size <= few) {
    values.resize(size + past_end, infinity);
    return of_few(values.data(), static_cast<int>(size), rank);
  }
  std::ranges::nth_element(values, values.begin() + rank - 1);
  return values[rank - 1];
}

template <int D>
void LeafSearch<D>::gather(const Tree<D>& tree, Leaf leaf, double reach) {
  gather(tree, box_around(tree, leaf, reach));
}

template <int D>
void LeafSearch<D>::gather(const Tree<D>& tree, const Point<D>& x, double reach) {
  Box<D> box{x, x};
  for (int a = 0; a < D; ++a) box.low[a] -= reach, box.high[a] += reach;
  gather(tree, box);
}

template <int D>
void LeafSearch<D>::gather(const Tree<D>& tree, const Box<D>& box) {
  count_ = 0;
  runs_.assign(1, 0);
  periodic_ = false;
  for_each_image<D>(tree.box(), [&](const Point<D>& shift) { gather(tree, box, shift); });
  make_room(past_end);
  for (int a = 0; a < D; ++a) std::fill_n(candidates_.x[a].begin() + count_, past_end, infinity);
}

/// They came in runs that ascend, which are merged two by two.
template <int D>
void LeafSearch<D>::sort() {
  if (std::is_sorted(candidates_.number.begin(), candidates_.number.begin() + count_)) return;
  keys_.resize(count_);
  merged_.resize(count_);
  for (int c = 0; c < count_; ++c)
    keys_[c] = static_cast<std::uint64_t>(candidates_.number[c]) << 32 | static_cast<unsigned>(c);
  while (runs_.size() > 2) {
    std::size_t to = 1;
    for (std::size_t r = 0; r + 1 < runs_.size(); r += 2) {
      const std::size_t last = std::min(r + 2, runs_.size() - 1);
      merge(runs_[r], runs_[r + 1], runs_[last]);
      runs_[to++] = runs_[last];
    }
    runs_.resize(to);
    keys_.swap(merged_);
  }
  sorted_.resize(candidates_.number.size() - past_end);
  for (int c = 0; c < count_; ++c) {
    sorted_.number[c] = static_cast<int>(keys_[c] >> 32);
    for (int a = 0; a < D; ++a)
      sorted_.x[a][c] = candidates_.x[a][static_cast<std::uint32_t>(keys_[c])];
  }
  for (int a = 0; a < D; ++a) std::fill_n(sorted_.x[a].begin() + count_, past_end, infinity);
  std::swap(candidates_, sorted_);
}

template <int D>
typename LeafSearch<D>::Found LeafSearch<D>::select(const Point<D>& x, double support,
                                                    int* found) const {
  int coincident = 0;
  int count = code_.select[D - 1](candidates_.coordinates().data(), candidates_.number.data(),
                                  count_, x.data(), support * support, found, &coincident);
  // At half a box, rounding can let two images of the same point pass.
  if (periodic_) count = static_cast<int>(std::unique(found, found + count) - found);
  return {coincident > 1 ? 0 : count, coincident > 1};
}

template <int D>
int LeafSearch<D>::select_all(const Point<D>& x, double support, int* found) const {
  int count = 0;
  for (int c = 0; c < count_; ++c) {
    const int number = candidates_.number[c];
    const bool again = count > 0 && found[count - 1] == number;  // another image
    if (!again && squared_distance(x, c) < support * support) found[count++] = number;
  }
  return count;
}

template <int D>
typename LeafSearch<D>::Nearest LeafSearch<D>::nearest(const Point<D>& x) const {
  Nearest result{-1, infinity};
  for (int c = 0; c < count_; ++c) {
    const double squared = squared_distance(x, c);
    const int number = candidates_.number[c];
    if (squared < result.squared || (squared == result.squared && number < result.number))
      result = {number, squared};
  }
  return result;
}

template <int D>
double LeafSearch<D>::nearest_squared(int i, const Point<D>& x) const {
  return code_.nearest[D - 1](candidates_.coordinates().data(), candidates_.number.data(), count_,
                              x.data(), i);
}

template <int D>
double LeafSearch<D>::squared_distance(const Point<D>& x, int c) const {
  double squared = 0;
  for (int a = 0; a < D; ++a) {
    const double r = candidates_.x[a][c] - x[a];
    squared += r * r;
  }
  return squared;
}

/// The count-th of the squares; infinity if there are fewer.
template <int D>
double LeafSearch<D>::nearest_squared(int i, const Point<D>& x, int count, double reach) {
  for (int c = static_cast<int>(places_.size()); c < count_ + past_end; ++c) places_.push_back(c);
  within_.resize(std::max<std::size_t>(within_.size(), most()));
  int at_x = 0;
  const int found = code_.select[D - 1](candidates_.coordinates().data(), places_.data(), count_,
                                        x.data(), reach * reach, within_.data(), &at_x);
  squares_.assign(std::max(0, at_x - (i >= 0)), 0.0);  // without the point itself
  for (int k = 0; k < found; ++k)
    if (candidates_.number[within_[k]] != i) squares_.push_back(squared_distance(x, within_[k]));
  // Rounding may have left out who is just there.
  const double least = ranked(squares_, count);
  return least < reach * reach * (1 - 1e-14) ? least : infinity;
}

template <int D>
void LeafSearch<D>::make_room(int more) {
  const auto wanted = static_cast<std::size_t>(count_ + more);
  if (candidates_.number.size() < wanted + past_end) candidates_.resize(2 * wanted);
}

/// Those of one image.
template <int D>
void LeafSearch<D>::gather(const Tree<D>& tree, const Box<D>& box, const Point<D>& shift) {
  Box<D> image = box;
  for (int a = 0; a < D; ++a) image.low[a] -= shift[a], image.high[a] -= shift[a];
  const int before = count_;
  const auto from = tree.points().coordinates();
  tree.leaves_in(image, cells_, leaves_);
  for (const Leaf leaf : leaves_) {
    make_room(leaf.end - leaf.begin);
    std::array<double*, D> to;
    for (int a = 0; a < D; ++a) to[a] = candidates_.x[a].data() + count_;
    const int added = code_.filter[D - 1](
        from.data(), tree.points().number.data(), leaf.begin, leaf.end, image.low.data(),
        image.high.data(), shift.data(), to.data(), candidates_.number.data() + count_);
    if (added == 0) continue;
    const bool ascends = count_ == 0 || candidates_.number[count_ - 1] < candidates_.number[count_];
    count_ += added;
    if (ascends && runs_.size() > 1)
      runs_.back() = count_;
    else
      runs_.push_back(count_);
  }
  periodic_ |= count_ > before && shift != Point<D>{};
}

template <int D>
void LeafSearch<D>::merge(int begin, int middle, int end) {
  const std::uint64_t* a = keys_.data() + begin;
  const std::uint64_t* b = keys_.data() + middle;
  const std::uint64_t *const a_end = b, *const b_end = keys_.data() + end;
  std::uint64_t* to = merged_.data() + begin;
  while (a < a_end && b < b_end) {
    const bool second = *b < *a;
    *to++ = second ? *b : *a;
    a += !second;
    b += second;
  }
  std::copy(b, b_end, std::copy(a, a_end, to));
}

template class LeafSearch<1>;
template class LeafSearch<2>;
template class LeafSearch<3>;

}  // namespace gradpsi
