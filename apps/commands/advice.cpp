#include "commands/advice.hpp"

#include <algorithm>

#include "common/columns.hpp"

namespace gradpsi::apps::candidates {

namespace {

/// The column of a user's field, if there is one.
std::string field_column(const Table& table, const std::string& fixed) {
  const auto is_field = [&](const std::string& column) {
    return column != "x" && column != "y" && column != "z" && column != "volume" && column != fixed;
  };
  const auto found = std::ranges::find_if(table.names, is_field);
  return found == table.names.end() ? "COLUMN" : *found;
}

/// The options that say what the points are.
std::string points_options(const AdviseOptions& options, int dimension) {
  std::string out;
  if (options.kernel != kernels().front().name) out += " --kernel " + options.kernel;
  if (options.volume) out += " --volume " + text(*options.volume);
  if (std::ranges::any_of(options.periodic, [](double l) { return l > 0; })) {
    out += " --periodic ";
    for (int a = 0; a < dimension; ++a) out += (a > 0 ? "," : "") + text(options.periodic[a]);
  }
  if (options.duplicates != "error") out += " --duplicates " + options.duplicates;
  return out;
}

std::string described(const Candidate& c) {
  return name(c.scheme) + (std::isnan(c.support_ratio)
                               ? " with the column 'support'"
                               : " with --support-ratio " + text(c.support_ratio));
}

std::string remark(const Candidate& c) {
  return c.zero > 0      ? "   " + std::to_string(c.zero) + " cannot be computed"
         : c.widened > 0 ? "   " + std::to_string(c.widened) + " widened"
                         : "";
}

Columns<Candidate> columns(const Trial& trial, const Candidate* chosen) {
  const auto mark = [&trial, chosen](const Candidate& c) {
    return &c == chosen ? "=> " : c.error <= trial.tolerance ? " + " : "   ";
  };
  const auto stable = [&trial](const Candidate& c) {
    return !c.looked_at || trial.use == Use::Derivative ? "-" : c.grows ? "no" : "yes";
  };
  const double unit = trial.spacing * trial.spacing;
  Columns<Candidate> all = {
      {"", mark, {.width = 3}},
      {"scheme", [](auto& c) { return name(c.scheme); }, {.width = -29}},
      {"h/dx", &Candidate::support_ratio, {"%.1f", 4}},
      {"entries", &Candidate::entries, {"%.1f", 10}},
      {"error rms", &Candidate::error, {"%.1e", 12}},
      {"worst", &Candidate::worst, {"%.1e", 10}},
      {"ns a point", [](auto& c) { return 1e9 * (c.assemble + c.product); }, {"%.4g", 13}}};
  if (trial.laplacian()) {
    all.push_back({"dt nu/dx^2", [unit](auto& c) { return c.step / unit; }, {"%.3g", 13}});
    all.push_back({"stable", stable, {.width = 9}});
  }
  all.push_back({"   rows", remark});
  return all;
}

std::string which_spacing(const Trial& trial, std::vector<Candidate>& all) {
  const auto found = sufficient_spacing(trial, all);
  if (!found) return "";
  return "A spacing of about " + cell(found->spacing, "%.2g") + " would (now " +
         cell(trial.spacing, "%.2g") + "), with " + described(*found->candidate) +
         ", whose error is of order " + std::to_string(order(found->candidate->scheme)) + ".\n";
}

}  // namespace

std::string command_line(const AdviseOptions& options, const Points& points, const Candidate& c) {
  const Use use = options.what_for();
  const std::string name_of_field = " --field " + field_column(points.table, options.fixed);
  std::string out = std::string("gradpsi ") +
                    (use == Use::Implicit   ? "diffuse "
                     : use == Use::Explicit ? "assemble "
                                            : "derive ") +
                    options.points.string();
  if (use != Use::Explicit) out += name_of_field;
  out += " --scheme " + name(c.scheme);
  if (!std::isnan(c.support_ratio)) out += " --support-ratio " + text(c.support_ratio);
  out += points_options(options, points.cloud.dimension());
  if (c.widened > 0 || c.scheme.consistency == Consistency::Positive)
    out += " --on-degenerate widen";
  if (use == Use::Implicit && !options.fixed.empty()) out += " --fixed " + options.fixed;
  if (use == Use::Implicit) out += " --time-step DT --steps N";
  return out + (use == Use::Explicit ? " -o OUT.mtx" : " -o OUT.vtu");
}

std::string advice(const Trial& trial, std::vector<Candidate>& all, const Candidate* chosen,
                   const std::string& command) {
  if (chosen) {
    std::string out = "Take " + described(*chosen) + ": error " + cell(chosen->error, "%.2g") +
                      " (root mean square, relative; worst row " + cell(chosen->worst, "%.2g") +
                      ")\n\n    " + command + '\n';
    if (trial.use == Use::Explicit)
      out += "\nExplicit Euler steps are stable up to dt nu = " + text(chosen->step) + ".\n";
    return out;
  }
  if (const Candidate* best = most_accurate(trial, all))
    return "Nothing meets " + text(trial.tolerance) + ". The best is " + described(*best) +
           ": error " + cell(best->error, "%.2g") + ".\n" + which_spacing(trial, all);
  return std::string("Nothing can be ") +
         (trial.use == Use::Derivative ? "computed" : "stepped in time") + " on these points.\n";
}

std::string table(const Trial& trial, const std::vector<Candidate>& all, const Candidate* chosen) {
  const bool steps = trial.use != Use::Derivative;
  return std::string("In the order of their cost (") +
         (!steps                       ? "search, weights and a product"
          : trial.use == Use::Explicit ? "entries over the stable step"
                                       : "entries") +
         "); + meets the tolerance" + (steps ? ", - not looked at" : "") + ":\n\n" +
         text_table(columns(trial, chosen), all);
}

std::string comparison(const Trial& trial, const Candidate* chosen, Timer& timer) {
  std::vector<Candidate> all = candidates(trial, trial.evolving, timer);
  const Candidate* const best = cheapest(trial, all);
  const std::string begin = "Brute force, " + std::to_string(all.size()) + " candidates on all " +
                            std::to_string(trial.evolving.size()) + " rows: ";
  if (!best || !chosen)
    return begin +
           (best ? "the choice would be " + described(*best) : "nothing meets the tolerance") +
           (chosen ? "" : "; the sample found nothing") + '\n';
  const auto same = std::ranges::find_if(all, [&](const Candidate& c) {
    return c.scheme == chosen->scheme && !(c.support_ratio < chosen->support_ratio) &&
           !(c.support_ratio > chosen->support_ratio);
  });
  return begin + described(*best) + "; the choice from the sample has an error of " +
         cell(same->error, "%.2g") + " there and a regret of " +
         cell(100 * (same->cost / best->cost - 1), "%.1f") + " %\n";
}

}  // namespace gradpsi::apps::candidates
