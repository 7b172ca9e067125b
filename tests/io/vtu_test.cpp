#include "io/files.hpp"

namespace gradpsi {
namespace {

using testing::HasSubstr;
using Write = Files;

TEST_F(Write, PvtuNamesFieldsAndPieces) {
  write_pvtu(path("a.pvtu"), {"x", "y", "T <K>"}, {path("a_rank0.vtu"), path("a_rank1.vtu")});
  const std::string text = content(path("a.pvtu"));
  EXPECT_THAT(text, HasSubstr("<PDataArray type=\"Float64\" Name=\"T &lt;K>\"/>"));
  EXPECT_THAT(text, testing::Not(HasSubstr("Name=\"y\"")));
  EXPECT_THAT(text, HasSubstr("<Piece Source=\"a_rank0.vtu\"/>\n<Piece Source=\"a_rank1.vtu\"/>"));
}

TEST_F(Write, VtuNeedsAPositionAndHoldsTheFields) {
  EXPECT_THROW(write_vtu(path("a.vtu"), Table{{"T"}, Eigen::MatrixXd::Zero(2, 1)}), InvalidInput);
  write_vtu(path("a.vtu"), Table{{"x", "a<b"}, Eigen::MatrixXd::Zero(2, 2)});
  const std::string text = content(path("a.vtu"));
  EXPECT_THAT(text, HasSubstr("NumberOfPoints=\"2\""));
  EXPECT_THAT(text, HasSubstr("Name=\"a&lt;b\""));
  EXPECT_THAT(text, testing::Not(HasSubstr("Name=\"x\"")));
}

TEST_F(Write, VtuHasVectorsBesideTheirColumns) {
  Table table{{"x", "vx", "vz"}, Eigen::MatrixXd::Random(2, 3)};
  table.add_vector("v", {"vx", "", "vz"});
  write_vtu(path("a.vtu"), table);
  EXPECT_THAT(content(path("a.vtu")),
              testing::AllOf(HasSubstr("Name=\"vz\" format"),
                             HasSubstr("Name=\"v\" NumberOfComponents=\"3\"")));
  EXPECT_EQ(table.select({1}).vectors.size(), 1);
  // A name stands for one thing, and components must be there.
  EXPECT_THROW(table.add("v", Eigen::VectorXd::Zero(2)), InvalidInput);
  EXPECT_THROW(table.add_vector("vx", {"x", "", ""}), InvalidInput);
  EXPECT_THROW(table.add_vector("v", {"x", "", ""}), InvalidInput);
  EXPECT_THROW(table.add_vector("w", {"y", "", ""}), InvalidInput);
}

}  // namespace
}  // namespace gradpsi
