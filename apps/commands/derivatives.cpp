#include "commands/derivatives.hpp"

#include <algorithm>
#include <array>
#include <gradpsi/spmv.hpp>
#include <limits>

namespace gradpsi::apps {

namespace {

constexpr Quantity table[] = {
    {"gradient", Derivative::Gradient, {}, "", "grad_"},
    {"laplacian", Derivative::Laplacian, {}, "lap_", nullptr},
    {"hessian", Derivative::Hessian, {}, "", nullptr},
    {"value", Derivative::Value, {}, "", nullptr},
    {"divergence", Derivative::Gradient, VectorOperator::Divergence, "div_", nullptr},
    {"curl", Derivative::Gradient, VectorOperator::Curl, "curl_", "curl_"},
    {"strain", Derivative::Gradient, VectorOperator::Strain, "strain_", nullptr},
    {"grad-div", Derivative::Hessian, VectorOperator::GradDiv, "grad_div_", "grad_div_"},
};

std::string joined(const std::vector<std::string>& words, const std::string& between) {
  std::string text;
  for (const std::string& word : words) text += (&word == &words.front() ? "" : between) + word;
  return text;
}

/// What is left of the names without the axes that they end in, "v" of vx, vy; empty if it differs.
std::string common_stem(const std::vector<std::string>& fields) {
  const std::string stem = fields.front().substr(0, fields.front().size() - 1);
  for (const std::string& field : fields)
    if (field.size() != stem.size() + 1 || !field.starts_with(stem)) return "";
  return stem;
}

/// Whether the columns' names say that they are a vector's components.
bool is_vector(const std::vector<std::string>& fields, const std::string& axes) {
  if (fields.size() != axes.size() || common_stem(fields).empty()) return false;
  for (std::size_t a = 0; a < fields.size(); ++a)
    if (fields[a].back() != axes[a]) return false;
  return true;
}

/// What the vector is called whose components these columns are: the stem "v" if no column is, else all of
/// their names.
std::string vector_name(const std::vector<std::string>& fields, const std::string& axes,
                        const Table& columns) {
  std::string stem = is_vector(fields, axes) ? common_stem(fields) : "";
  while (stem.ends_with('_')) stem.pop_back();
  return stem.empty() || columns.has(stem) ? joined(fields, "_") : stem;
}

/// Throws if the columns' names say that they are a vector's components in another order.
void check_order(const std::vector<std::string>& fields, const std::string& axes) {
  if (common_stem(fields).empty()) return;
  std::string ends;
  for (const std::string& field : fields) ends += field.back();
  if (ends == axes || !std::ranges::is_permutation(ends, axes)) return;
  std::vector<std::string> ordered;
  for (const char axis : axes) ordered.push_back(common_stem(fields) + axis);
  throw BadUsage("--field", "the components of a vector come in the order of their axes, " +
                                joined(ordered, ","));
}

/// The components' columns by x, y and z, "" where there is none.
std::array<std::string, 3> by_axis(const std::vector<std::string>& columns,
                                   const std::string& axes) {
  std::array<std::string, 3> result;
  for (std::size_t a = 0; a < columns.size(); ++a) result[axes[a] - 'x'] = columns[a];
  return result;
}

/// Of rows of the operator, at all points; nan where there is no row.
Eigen::VectorXd everywhere(const Eigen::VectorXd& of_rows, const Problem& problem) {
  if (problem.op.points.empty()) return of_rows;
  Eigen::VectorXd result =
      Eigen::VectorXd::Constant(problem.cloud.size(), std::numeric_limits<double>::quiet_NaN());
  result(problem.op.points) = of_rows;
  return result;
}

/// What the numbers of the quantity are called in terms of the points' own coordinates.
std::vector<std::string> number_names(const Quantity& what, const std::string& axes) {
  const auto d = static_cast<int>(axes.size());
  return in_axes(what.of_vector ? components(*what.of_vector, d) : components(what.derivative, d),
                 axes);
}

/// Adds what follows from the numbers u, a column a field, called `of` together.
void add_of(const Quantity& what, const Eigen::MatrixXd& u, const std::string& of,
            const std::vector<int>& unanswered, int threads, Problem& problem) {
  Eigen::MatrixXd found;
  if (what.of_vector)
    multiply(*what.of_vector, problem.op.axes, u, found, threads);
  else
    multiply(problem.op.axes, u.col(0), found, threads);
  found(unanswered, Eigen::all).setConstant(std::numeric_limits<double>::quiet_NaN());
  std::vector<std::string> columns;
  for (const std::string& number : number_names(what, problem.axes)) {
    const auto c = static_cast<Eigen::Index>(columns.size());
    columns.push_back(what.prefix + of + (number.empty() ? "" : '_' + number));
    problem.table.add(columns.back(), everywhere(found.col(c), problem));
  }
  if (what.vector && columns.size() == problem.axes.size())
    problem.table.add_vector(what.vector + of, by_axis(columns, problem.axes));
}

}  // namespace

std::span<const Quantity> quantities() { return table; }

std::vector<std::string> quantity_names() {
  std::vector<std::string> names;
  for (const Quantity& what : table) names.emplace_back(what.name);
  return names;
}

const Quantity& quantity(const std::string& wanted, const Scheme& scheme) {
  const auto found = std::ranges::find_if(table, [&](const Quantity& what) {
    return wanted.empty() ? what.derivative == scheme.derivative : what.name == wanted;
  });
  if (found == std::end(table))
    throw BadUsage("--scheme", "there is nothing to derive by " + name(scheme));
  if (found->derivative == scheme.derivative) return *found;
  const std::string needed(name(found->derivative));
  throw BadUsage("--scheme", "--what " + wanted + " takes a scheme of a " + needed + ", not " +
                                 name(scheme) + "; `gradpsi schemes` lists them: " + needed +
                                 "-...");
}

const Quantity& quantity(const std::string& wanted) {
  const auto found = std::ranges::find(table, wanted, &Quantity::name);
  if (found == std::end(table))
    throw BadUsage("--what", "--tolerance needs it: gradient, laplacian, divergence, ..");
  if (found->derivative == Derivative::Value)
    throw BadUsage("--what", wanted + " takes a scheme, not a tolerance: value-mls-P with --at");
  return *found;
}

std::vector<std::string> field_names(const std::string& list) {
  std::vector<std::string> names;
  for (const std::string& name : listed("--field", list)) {
    if (std::ranges::find(names, name) != names.end())
      throw BadUsage("--field", "column '" + name + "' is there twice");
    names.push_back(name);
  }
  return names;
}

void check_fields(const Quantity& what, const std::vector<std::string>& fields,
                  const OperatorOptions& options, const std::string& axes) {
  if (!what.of_vector) return;
  const auto d = static_cast<int>(axes.size());
  const std::string dimension = std::to_string(d) + "D";
  if (components(*what.of_vector, d).empty())
    throw BadUsage("--what", "there is no " + std::string(what.name) + " in " + dimension);
  if (std::ssize(fields) != d)
    throw BadUsage("--field", "the " + std::string(what.name) + " of points in " + dimension +
                                  " takes " + count(d, "column") + ", the components along " +
                                  axes + ", not " + std::to_string(fields.size()));
  if (options.on_surface && d == 3 && *what.of_vector != VectorOperator::Divergence)
    throw BadUsage("--on-surface", "of vectors on a surface there is the divergence only");
  check_order(fields, axes);
}

void add_quantity(const Quantity& what, const std::vector<std::string>& fields,
                  const Eigen::MatrixXd& u, const std::vector<int>& unanswered, int threads,
                  Problem& problem) {
  if (!what.of_vector) {
    for (std::size_t c = 0; c < fields.size(); ++c)
      add_of(what, u.col(static_cast<Eigen::Index>(c)), fields[c], unanswered, threads, problem);
    if (what.derivative == Derivative::Value && fields.size() > 1 &&
        is_vector(fields, problem.axes))
      problem.table.add_vector(vector_name(fields, problem.axes, problem.table),
                               by_axis(fields, problem.axes));
    return;
  }
  const std::string of = vector_name(fields, problem.axes, problem.table);
  add_of(what, u, of, unanswered, threads, problem);
  if (problem.table.has(fields.front()))  // not those of probes
    problem.table.add_vector(of, by_axis(fields, problem.axes));
}

}  // namespace gradpsi::apps
