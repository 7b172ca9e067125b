// Points, and who is near whom.

#include <optional>
#include <string>

#include "python/arrays.hpp"

namespace gradpsi::python {
namespace {

Cloud cloud(const ArrayLike& positions, const ArrayLike& volumes, const ArrayLike& box) {
  Positions x = python::positions(positions, "positions");
  CloudOptions options{.volumes = optional_vector(volumes, "volumes", x.rows())};
  const DenseVector lengths = optional_vector(box, "box", x.cols());
  for (Eigen::Index a = 0; a < std::min<Eigen::Index>(lengths.size(), 3); ++a)
    options.box[a] = lengths[a];
  return Cloud(std::move(x), std::move(options));
}

py::object cloud_positions(const py::object& self) {
  const auto& cloud = self.cast<const Cloud&>();
  const Positions& x = cloud.positions();
  return view(x.data(), x.size(), self).attr("reshape")(x.rows(), x.cols());
}

py::object cloud_volumes(const py::object& self) {
  const auto& cloud = self.cast<const Cloud&>();
  if (!cloud.has_volumes()) return py::none();
  return view(cloud.volumes(), self);
}

py::tuple cloud_box(const Cloud& cloud) {
  py::tuple box(cloud.dimension());
  for (int a = 0; a < cloud.dimension(); ++a) box[a] = cloud.box()[a];
  return box;
}

Neighbours neighbours(const Cloud& cloud, const ArrayLike& support, int threads,
                      std::optional<double> skin) {
  const auto h = number(support, "support");
  const DenseVector supports = h ? DenseVector::Constant(1, *h) : vector(support, "support");
  return without_gil([&] {
    return skin ? find_neighbours(cloud, supports, Skin{*skin}, threads)
                : find_neighbours(cloud, supports, threads);
  });
}

py::array_t<int> neighbours_of(const py::object& self, int point) {
  const auto& near = self.cast<const Neighbours&>();
  if (point < 0 || point >= near.size())
    throw py::index_error("point " + std::to_string(point) + " of " + std::to_string(near.size()));
  return view(near.of(point).data(), near.count(point), self);
}

template <IndexVector Neighbours::*member>
py::array_t<int> member_view(const py::object& self) {
  return view(self.cast<const Neighbours&>().*member, self);
}

void bind_points(py::module_& m) {
  py::class_<Cloud>(m, "Cloud", R"(Points with their volumes, in open space or a periodic box.

Does not change once it is made; len(cloud) is the number of points.)")
      .def(py::init(&cloud), py::arg("positions"), py::arg("volumes") = py::none(),
           py::arg("box") = py::none(),
           R"(positions: n x d finite coordinates, d = 1, 2 or 3, or n for points on a line; copied.
volumes: n numbers > 0 (length^d); None: assemble() takes number_density_volumes().
box: d lengths of a periodic box that starts at the origin; 0: open in that direction.
  Points outside stand for their image.
Raises InvalidInput naming the point or the argument. That no two points coincide is checked by
find_neighbours(); distinct_points() finds them beforehand.)")
      .def("__len__", &Cloud::size)
      .def("__repr__",
           [](const Cloud& cloud) {
             return "<gradpsi.Cloud: " + std::to_string(cloud.size()) + " points in " +
                    std::to_string(cloud.dimension()) + "D>";
           })
      .def_property_readonly("dimension", &Cloud::dimension, "d: 1, 2 or 3")
      .def_property_readonly("positions", &cloud_positions, "n x d, read-only, not a copy")
      .def_property_readonly("volumes", &cloud_volumes,
                             "n, length^d, read-only, not a copy; None without volumes")
      .def_property_readonly("box", &cloud_box, "d lengths; 0: open in that direction")
      .def(
          "spacing",
          [](const Cloud& cloud, int threads) {
            return without_gil([&] { return cloud.spacing(threads); });
          },
          py::arg("threads") = 0,
          R"((mean volume)^(1/d) with volumes, else the median distance to the nearest neighbour
(a length).

threads 0: as many as OpenMP offers. O(n log n).
Raises InvalidInput without volumes and with fewer than two points, or if most coincide.)");
}

void bind_sources(py::module_& m) {
  m.def(
      "read_cloud",
      [](const std::filesystem::path& file) {
        return without_gil([&] { return read_cloud(file); });
      },
      py::arg("file"),
      R"(The points of a comma-separated file: columns x, y, z and, if there, volume.

Raises InvalidInput naming file and line, OSError if the file cannot be read.)");
  m.def(
      "lattice",
      [](int points_per_side, int dimension, double lower, double upper, double jitter,
         std::uint64_t seed, bool periodic, double grading) {
        return without_gil([&] {
          return make_cloud(Lattice{.dimension = dimension,
                                    .points_per_side = points_per_side,
                                    .lower = lower,
                                    .upper = upper,
                                    .jitter = jitter,
                                    .seed = seed,
                                    .periodic = periodic,
                                    .grading = grading});
        });
      },
      py::arg("points_per_side"), py::kw_only(), py::arg("dimension") = 2, py::arg("lower") = 0.0,
      py::arg("upper") = 1.0, py::arg("jitter") = 0.0, py::arg("seed") = 1,
      py::arg("periodic") = false, py::arg("grading") = 1.0,
      R"(Points at the centres of equal cells of [lower, upper]^d, with volumes; last coordinate
fastest.

jitter: each coordinate moves by up to +-jitter cells, uniformly; the same seed gives the same
  points on every platform. periodic: in all directions, which needs lower = 0.
grading: points are drawn together towards the centre, where spacings are so many times smaller
  than along the faces.
Raises InvalidInput if a number is out of range.)");
}

void bind_orders(py::module_& m) {
  m.def(
      "distinct_points",
      [](const Cloud& cloud) {
        const std::vector<int> points = without_gil([&] { return distinct_points(cloud); });
        return py::array_t<int>(static_cast<py::ssize_t>(points.size()), points.data());
      },
      py::arg("cloud"),
      R"(Indices of the points that remain, ascending, when all but the first of coincident ones
are dropped.

cloud.positions[distinct_points(cloud)] are then positions that find_neighbours() accepts. O(n
log n).)");
  m.def(
      "reorder",
      [](const Cloud& cloud, int threads) {
        auto [reordered, order] = without_gil([&] { return reorder(cloud, threads); });
        return py::make_tuple(
            std::move(reordered),
            py::array_t<int>(static_cast<py::ssize_t>(order.size()), order.data()));
      },
      py::arg("cloud"), py::arg("threads") = 0,
      R"(A cloud whose points are near in memory where they are near in space, and their former
indices.

Point k of the new cloud is point order[k] of the old one; a field goes along by u[order].
Products with matrices of points in random order take several times as long. O(n log n).)");
}

void bind_neighbours(py::module_& m) {
  py::class_<Neighbours>(m, "Neighbours", R"(Who is within whose support, as compressed rows.

The neighbours of point i are indices[offsets[i]:offsets[i + 1]], ascending, i itself not among
them.
Made by find_neighbours(); len(near) is the number of points. All arrays are read-only, not
copies.)")
      .def("__len__", &Neighbours::size)
      .def("__repr__",
           [](const Neighbours& near) {
             return "<gradpsi.Neighbours: " + std::to_string(near.indices.size()) + " of " +
                    std::to_string(near.size()) + " points>";
           })
      .def("of", &neighbours_of, py::arg("point"),
           "The neighbours of one point; IndexError without it")
      .def_property_readonly("offsets", &member_view<&Neighbours::offsets>, "n + 1")
      .def_property_readonly("indices", &member_view<&Neighbours::indices>, "Points from 0")
      .def_property_readonly(
          "supports",
          [](const py::object& self) {
            return view(self.cast<const Neighbours&>().supports, self);
          },
          "Lengths: one for all points, or n")
      .def_readonly("skin", &Neighbours::skin,
                    "How far the lists reach beyond the supports (a length); 0: not at all")
      .def_property_readonly(
          "order", &member_view<&Neighbours::order>,
          "The order in which rows are worked on: near points close to one another");
}

void bind_distances(py::module_& m) {
  m.def(
      "nearest_distances",
      [](const Cloud& cloud, int threads) {
        return without_gil([&] { return nearest_distances(cloud, threads); });
      },
      py::arg("cloud"), py::arg("threads") = 0,
      "Distance from each point to the nearest other one (n lengths; inf for a lone point). O(n "
      "log n).");
  m.def(
      "kth_nearest_distances",
      [](const Cloud& cloud, int k, int threads) {
        return without_gil([&] { return kth_nearest_distances(cloud, k, threads); });
      },
      py::arg("cloud"), py::arg("k"), py::arg("threads") = 0,
      R"(Distance from each point to its k-th nearest other one (n lengths): with a hair more as
supports, each has k neighbours at least. O(n log n).

Raises InvalidInput if k is not 1 to n - 1.)");
  m.def(
      "local_spacing",
      [](const Cloud& cloud, int threads) {
        return without_gil([&] { return local_spacing(cloud, threads); });
      },
      py::arg("cloud"), py::arg("threads") = 0,
      R"(The spacing of the points where they are: one length, cloud.spacing(), where points lie as
evenly as jittered or random ones, else n that vary slowly.

find_neighbours(cloud, 3 * local_spacing(cloud)) has supports that follow the points. O(n log n).
Raises InvalidInput as cloud.spacing() does.)");
}

constexpr auto find_neighbours_doc =
    R"(For each point all others nearer than its support, shortest images counting in periodic
directions.

support: h > 0 (a length), or n of them, one a point; in periodic directions at most half the
  box.
threads 0: as many as OpenMP offers; the result does not depend on it. O(n log n) and
  O(neighbours).
skin > 0: how far lists reach beyond the supports (a length). As long as no point has moved by
  more than half of it, reassemble() gives what the points' own lists would give, on a pattern
  that stays.
Raises InvalidInput if a support is out of range, points coincide (the first pair is named),
most points have no neighbour, or there would be more than 2^31 - 1 entries.)";

void bind_searches(py::module_& m) {
  m.def("find_neighbours", &neighbours, py::arg("cloud"), py::arg("support"),
        py::arg("threads") = 0, py::kw_only(), py::arg("skin") = py::none(), find_neighbours_doc);
  m.def(
      "is_stale",
      [](const Neighbours& near, const Cloud& cloud, int threads) {
        return without_gil([&] { return is_stale(near, cloud, threads); });
      },
      py::arg("near"), py::arg("cloud"), py::arg("threads") = 0,
      R"(Whether a point has moved by more than half the skin since `near` was found: a neighbour may
then be missing, and whatever takes `near` refuses it.

cloud: the same n points, where they are now. One pass over the positions.
Raises InvalidInput if `near` has no skin or is of other points.)");
  m.def(
      "number_density_volumes",
      [](const Cloud& cloud, const Neighbours& near, const std::string& kernel_name, int threads) {
        const Kernel& of_that_name = kernel(kernel_name);
        return without_gil(
            [&] { return number_density_volumes(cloud, near, of_that_name, threads); });
      },
      py::arg("cloud"), py::arg("near"), py::arg("kernel") = kernels().front().name,
      py::arg("threads") = 0,
      R"(Volumes by number density, 1 / sum_j W_ij, j = i included, with row i's support (n,
length^d).

Raises InvalidInput if `near` belongs to another number of points, or a volume is beyond a
double.)");
}

}  // namespace

void bind_cloud(py::module_& m) {
  bind_points(m);
  bind_sources(m);
  bind_orders(m);
  bind_neighbours(m);
  bind_searches(m);
  bind_distances(m);
}

}  // namespace gradpsi::python
