// Any bytes as a table of points: refused as the interface says, or a table that can be written and
// read again, and points that are those of the table.

#include <gradpsi/gradpsi.hpp>

#include "fuzz.hpp"

using namespace gradpsi;

namespace {

void require_same(const Table& a, const Table& b) {
  require(a.names == b.names, "names survive");
  require(a.values.rows() == b.values.rows() && a.values.cols() == b.values.cols(), "so do sizes");
  for (Eigen::Index k = 0; k < a.values.size(); ++k)
    require(same(a.values.data()[k], b.values.data()[k]), "and values");
  require(a.texts.size() == b.texts.size(), "and which columns are texts");
  for (std::size_t k = 0; k < a.texts.size(); ++k)
    require(a.texts[k].name == b.texts[k].name && a.texts[k].cells == b.texts[k].cells,
            "and texts");
}

void require_points(const Table& table, const Cloud& cloud) {
  require(cloud.size() == table.values.rows(), "each row is a point");
  const char* const axes[] = {"x", "y", "z"};
  for (int a = 0; a < cloud.dimension(); ++a) {
    const Eigen::VectorXd x = table.column(axes[a]);
    for (int i = 0; i < cloud.size(); ++i)
      require(std::isfinite(x[i]) && same(cloud.positions()(i, a), x[i]),
              "coordinates are those of the table, and finite");
  }
  require(cloud.dimension() == 3 || !table.has(axes[cloud.dimension()]), "no coordinate is lost");
  require(cloud.has_volumes() == (table.has("volume") && cloud.size() > 0),
          "volumes are those of the table");
  for (const double volume : cloud.volumes())
    require(volume > 0 && std::isfinite(volume), "volumes are positive");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static MemoryFile file, copy;
  file.assign(data, size);
  try {
    const Table table = read_csv(file.path());
    require(std::ssize(table.names) == table.values.cols() && !table.names.empty(),
            "each column has a name");
    write_csv(copy.path(), table);
    try {
      require_same(table, read_csv(copy.path()));
    } catch (const InvalidInput& error) {
      require(false, error.what());
    }
    require_points(table, make_cloud(table));
  } catch (const InvalidInput&) {
  }
  return 0;
}
