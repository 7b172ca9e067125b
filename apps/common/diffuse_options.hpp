#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/operators.hpp"

namespace gradpsi::apps {

/// What --gradient says for walls by with_walls().
inline constexpr std::string_view positive_walls = "positive";

/// The options that say where the equation does not hold, or with what slope.
struct ConditionOptions : OperatorOptions {
  std::string fixed, normal, flux, transfer, gradient = std::string(positive_walls);

  Option declare_normal(Options& options);
  void declare_transfer(Options& options, const Option& normals);
  void declare_gradient(Options& options, const Option& normals);
  /// Throws unless `gradient` is a gradient, or positive.
  void check_gradient() const;
};

/// The options of `diffuse`.
struct DiffuseOptions : ConditionOptions {
  std::string field;
  double diffusivity = 1;
  std::optional<double> time_step;
  std::optional<int> steps;
  bool steady = false;
  double theta = 1;
  bool damped_start = false;
  std::string conductivity, mean = "arithmetic";
  std::string source;
  std::string method = "auto";
  double memory = 0;  // GB
  std::optional<int> every;
  std::filesystem::path output;

  /// Declares all of them.
  /// @param program  how it is called
  void declare_diffusion(Options& options, const std::string& output_words,
                         const std::string& program);
  /// Throws what can be said before there are points.
  void check() const;
  /// A file beside the output: OUT and this ending.
  std::filesystem::path beside(const std::string& ending) const;
  /// Whether a field is to be kept after this step.
  bool keeps(int step) const;
  /// OUT_007 for step 7 of hundreds, and an ending.
  std::filesystem::path numbered(int step, const std::string& ending) const;
  /// The title of the picture.
  std::string title() const;

 private:
  void declare_field(Options& options);
  Option declare_steps(Options& options);
  void declare_conditions(Options& options);
  void declare_materials(Options& options);
  void declare_solver(Options& options);
};

}  // namespace gradpsi::apps
