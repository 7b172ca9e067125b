#include "scenes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <optional>
#include <random>

namespace {

using gradpsi::Cloud;
using gradpsi::Neighbours;

constexpr double usual_ratio[] = {3.5, 3.0, 2.6};

Cloud permuted(const Cloud& cloud, const std::vector<int>& order) {
  return Cloud(cloud.positions()(order, Eigen::all), {.volumes = cloud.volumes()(order)});
}

std::vector<int> shuffled(int n) {
  std::vector<int> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), std::mt19937_64(1));
  return order;
}

/// Appends the points that can be reached from `start` and were not seen yet, breadth first, those with
/// few neighbours before others.
void append_reachable(const Neighbours& near, int start, std::vector<bool>& seen,
                      std::vector<int>& order) {
  std::size_t next = order.size();
  order.push_back(start);
  seen[start] = true;
  for (; next < order.size(); ++next) {
    const std::size_t first = order.size();
    for (const int j : near.of(order[next])) {
      if (seen[j]) continue;
      seen[j] = true;
      order.push_back(j);
    }
    std::sort(order.begin() + static_cast<std::ptrdiff_t>(first), order.end(), [&](int a, int b) {
      return std::pair(near.count(a), a) < std::pair(near.count(b), b);
    });
  }
}

/// Reverse Cuthill-McKee. Each part of the graph starts at the last point of a first walk through it,
/// which is far from the point that walk began at.
std::vector<int> reverse_cuthill_mckee(const Neighbours& near) {
  std::vector<bool> trial_seen(near.size(), false), seen(near.size(), false);
  std::vector<int> trial, order;
  for (int i = 0; i < near.size(); ++i) {
    if (seen[i]) continue;
    append_reachable(near, i, trial_seen, trial);
    append_reachable(near, trial.back(), seen, order);
  }
  std::reverse(order.begin(), order.end());
  return order;
}

Cloud in_order(const Scene& scene) {
  Cloud lattice = make_cloud(gradpsi::Lattice{.dimension = scene.dimension,
                                              .points_per_side = scene.points_per_side,
                                              .jitter = 0.2,
                                              .grading = scene.grading});
  if (scene.order == "tree") return reorder(lattice).cloud;
  if (scene.order == "random") return permuted(lattice, shuffled(lattice.size()));
  if (scene.order == "rcm")
    return permuted(lattice, reverse_cuthill_mckee(
                                 find_neighbours(lattice, scene.ratio() * lattice.spacing())));
  return lattice;
}

}  // namespace

double Scene::ratio() const {
  return support_ratio > 0 ? support_ratio : usual_ratio[dimension - 1];
}

int Scene::size() const {
  return static_cast<int>(std::lround(std::pow(points_per_side, dimension)));
}

std::string Scene::name() const {
  std::string result = "dim:" + std::to_string(dimension) + "/n:" + std::to_string(size());
  const auto add = [&](const char* format, double value) {
    char text[32];
    std::snprintf(text, sizeof text, format, value);
    result += text;
  };
  if (ratio() != usual_ratio[dimension - 1]) add("/ratio:%g", ratio());
  if (grading != 1) add("/grading:%g", grading);
  return result + "/order:" + order;
}

gradpsi::Operator& Prepared::assembled(const std::string& scheme) {
  return operators.get(scheme, [&] { return assemble(scheme, cloud, near, assembly_options(0)); });
}

gradpsi::AssemblyOptions assembly_options(int threads) {
  return {.on_degenerate = gradpsi::OnDegenerate::Lower, .threads = threads};
}

Prepared& prepared(const Scene& scene) {
  static std::string name;
  static std::optional<Prepared> now;
  if (name != scene.name()) {
    now.reset();
    Cloud cloud = in_order(scene);
    const Eigen::VectorXd supports = scene.ratio() * local_spacing(cloud);
    Neighbours near = find_neighbours(cloud, supports);
    now.emplace(Prepared{std::move(cloud), std::move(near)});
    name = scene.name();
  }
  return *now;
}
