#pragma once

#include <gradpsi/gradpsi.hpp>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

/// Points of a lattice jittered by 0.2 cells, perhaps graded, in some order, and how far they see.
struct Scene {
  int dimension;
  int points_per_side;
  double support_ratio = 0;    ///< 0: the usual one of that dimension
  std::string order = "tree";  ///< lattice, random, tree or rcm
  double grading = 1;          ///< largest over least spacing, supports as many local spacings

  double ratio() const;
  int size() const;
  std::string name()
      const;  ///< dim:2/n:10000/order:tree, after n the ratio and grading if not the usual ones
};

/// Holds one value, made when it is first asked for; asking for another one frees it.
class Slot {
 public:
  template <class Make>
  auto& get(const std::string& key, const Make& make) {
    using T = std::decay_t<decltype(make())>;
    if (key != key_) {
      value_.reset();
      key_.clear();
      value_ = std::make_shared<T>(make());
      key_ = key;
    }
    return *static_cast<T*>(value_.get());
  }

 private:
  std::string key_;
  std::shared_ptr<void> value_;
};

/// A scene's points, neighbours and what benchmarks have made of them.
struct Prepared {
  gradpsi::Cloud cloud;
  gradpsi::Neighbours near;
  Slot operators = {}, reference = {}, derived = {};

  /// The operator of that scheme.
  gradpsi::Operator& assembled(const std::string& scheme);
  /// The matrix that products are measured with: symmetric, as volumes are equal.
  const gradpsi::SparseMatrix& laplacian() { return assembled("laplacian-mixed-zoc").axes[0]; }
  double neighbours() const {
    return static_cast<double>(near.indices.size()) / static_cast<double>(cloud.size());
  }
};

/// What every assembly here is asked for; rows near the surface may lack neighbours.
gradpsi::AssemblyOptions assembly_options(int threads);

/// The scene, made when first asked for. There is one at a time: large ones need the memory.
Prepared& prepared(const Scene& scene);
