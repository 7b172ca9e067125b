#include "common/picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <string_view>
#include <vector>

namespace gradpsi::apps {

namespace {

/// A string for gnuplot, where a quote is written twice.
std::string quoted(const std::string& text) {
  std::string result(1, '\'');
  for (const char c : text) result.append(c == '\'' ? 2 : 1, c);
  return result.append(1, '\'');
}

struct Range {
  double lower, upper;
  double length() const { return upper - lower; }
};

/// The values' range with `margin` of it on both sides; around what is constant to eight digits a range
/// as large as itself.
Range range(const Eigen::VectorXd& values, double margin) {
  const double lower = values.minCoeff(), upper = values.maxCoeff();
  const double size = std::max(std::abs(lower), std::abs(upper));
  double more = margin * (upper - lower);
  if (!(upper - lower > 1e-8 * size)) more = size > 0 ? size / 2 : 0.5;
  return {lower - more, upper + more};
}

/// What is drawn where: two coordinates, or in 1D the coordinate and the field itself.
struct View {
  char across_name;
  std::string up_name;
  Eigen::VectorXd across, up;
  std::vector<int> order;  // the points to draw, the nearest last
};

View view(const gradpsi::Positions& x, const Eigen::VectorXd& field, const std::string& name) {
  const auto axis = [&](int a) { return std::string(1, "xyz"[a]); };
  std::vector<int> order;
  constexpr Eigen::Index most = 200'000;
  for (Eigen::Index i = 0; i < x.rows(); i += (x.rows() + most - 1) / most)
    order.push_back(static_cast<int>(i));
  if (x.cols() == 1) return {'x', name, x.col(0), field, order};
  if (x.cols() == 2) return {'x', axis(1), x.col(0), x.col(1), order};
  int along;  // the line of sight
  (x.colwise().maxCoeff() - x.colwise().minCoeff()).minCoeff(&along);
  std::ranges::stable_sort(order, {}, [&](int i) { return x(i, along); });
  const int across = along == 0 ? 1 : 0, up = along == 2 ? 1 : 2;
  return {"xyz"[across], axis(up), x.col(across), x.col(up), order};
}

void write_script(FILE* out, const std::filesystem::path& png, const View& view,
                  Eigen::Index dimension, const Eigen::VectorXd& field, const std::string& name,
                  const std::string& title) {
  const bool curve = dimension == 1;
  const Range across = range(view.across, 0.03), up = range(view.up, 0.03),
              colour = range(field, 0);
  constexpr double width = 900, frame = 700;  // pixels
  const double shape = up.length() / across.length();
  const double height = curve ? 500 : std::clamp(frame * shape + 110, 300.0, 1400.0);
  // Dots as wide as the points are apart; a point size of 1 is 7 pixels.
  const double apart = frame * std::sqrt(shape / static_cast<double>(view.order.size()));
  const double dot = curve ? 0.6 : std::clamp(apart / 7, 0.25, 3.0);
  std::fprintf(out, "set encoding utf8\nset terminal pngcairo size %.0f, %.0f noenhanced ", width,
               height);
  std::fprintf(out, "font 'DejaVu Sans,11' background 'white'\nset output %s\nset title %s\n",
               quoted(png.string()).c_str(), quoted(title).c_str());
  std::fprintf(out, "unset key\nset border lw 0.8\nset tics nomirror out\n");
  std::fprintf(out, "set xlabel '%c'\nset ylabel %s\n", view.across_name,
               quoted(view.up_name).c_str());
  std::fprintf(out, "set xrange [%.9g:%.9g]\nset yrange [%.9g:%.9g]\nset cbrange [%.9g:%.9g]\n",
               across.lower, across.upper, up.lower, up.upper, colour.lower, colour.upper);
  if (curve)
    std::fprintf(out, "unset colorbox\nset grid lc rgb '#e4e4e4'\n");
  else
    std::fprintf(out, "set size ratio -1\nset cblabel %s\n", quoted(name).c_str());
  // Viridis: even in lightness, and readable without colours.
  std::fprintf(out, "set palette defined (0 '#440154', 1 '#46327e', 2 '#365c8d', 3 '#277f8e', ");
  std::fprintf(out, "4 '#1fa187', 5 '#4ac16d', 6 '#a0da39', 7 '#fde725')\n");
  std::fprintf(out, "plot '-' using 1:2:3 with points pt 7 ps %g lc palette\n", dot);
  for (const int i : view.order)
    std::fprintf(out, "%.9g %.9g %.9g\n", view.across[i], view.up[i], field[i]);
  std::fprintf(out, "e\nunset output\n");
}

}  // namespace

bool is_complete(const std::filesystem::path& picture) {
  std::ifstream file(picture, std::ios::binary);
  file.seekg(-8, std::ios::end);
  char end[8] = {};
  file.read(end, 8);
  const char* const mark = picture.extension() == ".svg" ? "</svg>" : "IEND";
  return file && std::string_view(end, 8).find(mark) != std::string_view::npos;
}

bool draw_field(const std::filesystem::path& png, const gradpsi::Positions& x,
                const Eigen::VectorXd& field, const std::string& name, const std::string& title) {
  if (x.rows() == 0) return false;
  FILE* const gnuplot = popen("gnuplot >/dev/null 2>&1", "w");
  if (!gnuplot) return false;
  const std::filesystem::path part = png.string() + ".part";
  write_script(gnuplot, part, view(x, field, name), x.cols(), field, name, title);
  bool drawn = std::ferror(gnuplot) == 0;
  drawn = pclose(gnuplot) == 0 && drawn && is_complete(part);
  std::error_code failure, ignored;
  if (drawn) std::filesystem::rename(part, png, failure);
  if (!drawn || failure) std::filesystem::remove(part, ignored);
  return drawn && !failure;
}

}  // namespace gradpsi::apps
