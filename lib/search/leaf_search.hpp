#pragma once

#include <cstdint>
#include <vector>

#include "search/candidates.hpp"
#include "search/tree.hpp"

namespace gradpsi {

/// The rank-th least of some values, 1 being the least; infinity if there are fewer. What is in `values` then is
/// nobody's.
double ranked(std::vector<double>& values, int rank);

/// Finds the neighbours of all points of a leaf together: the trees are walked once for the leaf's
/// box widened by the support, and the candidates found, sorted once, are tested for each point.
template <int D>
class LeafSearch {
 public:
  /// Candidates, in no order, for those of the points from leaf.begin to leaf.end.
  void gather(const Tree<D>& tree, Leaf leaf, double reach);
  /// The same for a place.
  void gather(const Tree<D>& tree, const Point<D>& x, double reach);
  /// Sorts the candidates by number.
  void sort();

  struct Found {
    int count;
    bool coincides;
  };
  /// How many numbers select() can write.
  int most() const { return count_ + past_end; }
  /// Writes the neighbours of the point at x, in the candidates' order, unless another point has no
  /// distance from it.
  Found select(const Point<D>& x, double support, int* found) const;
  /// Writes the candidates nearer to x than `support`, in their order, one that is there among them; returns how
  /// many.
  int select_all(const Point<D>& x, double support, int* found) const;
  struct Nearest {
    int number;
    double squared;  // distance
  };
  /// The candidate nearest to x, of several the one of least number; infinitely far if there is none.
  Nearest nearest(const Point<D>& x) const;
  /// The least squared distance of point i, at x, from another one; infinity if there is none.
  double nearest_squared(int i, const Point<D>& x) const;
  /// The count-th least one, if it is within the reach of gather(); else infinity. A place has no number: -1.
  double nearest_squared(int i, const Point<D>& x, int count, double reach);

 private:
  void make_room(int more);
  void gather(const Tree<D>& tree, const Box<D>& box);
  void gather(const Tree<D>& tree, const Box<D>& box, const Point<D>& shift);
  void merge(int begin, int middle, int end);
  double squared_distance(const Point<D>& x, int c) const;

  int count_ = 0;
  PointArrays<D> candidates_, sorted_;
  std::vector<int> runs_;     // where runs of ascending numbers end, after a 0
  std::vector<int> cells_;    // memory for leaves_in()
  std::vector<Leaf> leaves_;  // those of one image
  std::vector<std::uint64_t> keys_, merged_;
  std::vector<double> squares_;
  std::vector<int> places_, within_;  // of all candidates, and of those within a reach
  bool periodic_ = false;
  CandidateKernels code_ = candidate_kernels(cpu());
};

}  // namespace gradpsi
