#include <array>

#include "base/names.hpp"
#include "schemes/monomials.hpp"
#include "schemes/recipe.hpp"

namespace gradpsi {
namespace {

constexpr auto Gradient = Derivative::Gradient;
constexpr auto Laplacian = Derivative::Laplacian;
constexpr auto Hessian = Derivative::Hessian;
constexpr auto Value = Derivative::Value;
using Weight::Derivatives, Weight::Diffuse, Weight::DiffuseNs, Weight::Direct, Weight::Distance,
    Weight::Mixed;
constexpr auto W = Weight::Kernel;
using enum Consistency;
constexpr auto Same = Symmetry::Symmetric, Opposite = Symmetry::Antisymmetric, Any = Symmetry::None;

constexpr std::string_view none,
    r = " r_ij", B_r = " B_i r_ij", C_r = " (C0_i r_ij + C1_i : r_ij r_ij)",
    C_e = " (C0_i : e_ij e_ij + C1_i . r_ij)", c_p = " c_i . p(r_ij)",
    ee = " ((d+2) e_a e_b - delta_ab) / 2", psi = ">= 0, least sum (r/h)^5 psi_ij",
    plus = " r_ij, times u_j + u_i", own_r = " r_a / sum omega (-W'/r) r_a^2",
    damped = " r^2 / (r^2 + h^2/400)", c_g = "omega_j c_i . (g - <g> W), g = grad W_ij",
    c_t = "omega_j c_i . t, t = (grad W_ij, W_ab)",
    c_t_centred = "omega_j c_i . (t - <t> W), t = (grad W_ij, W_ab)",
    c_W = "omega_j c_i : W_ab - m_i . G_ij, G of gradient-direct-foc",
    c_centred = " c_i . (p(r_ij) - <W p>)", c_value = " (1/sum omega W + c_i . (p(r_ij) - <W p>))",
    N = " b . p_1(r_ij), differentiated at x_i", GG = "sum_a G_a G_a, G of gradient-mls-1",
    over_W = " / sum omega W - m_i . G_ij, G of gradient-mls-1";

// Tables I and II first, then what follows them.
constexpr std::array table = std::to_array<Recipe>({
    // clang-format off
    {Gradient, Direct, Zoc, 0, 0, How::Given, Form::Monomials, r, none, Opposite},
    {Gradient, Direct, Foc, 1, 1, How::Moments, Form::Monomials, B_r, "gradient-direct-zoc"},
    {Gradient, Direct, Soc, 2, 2, How::Moments, Form::Monomials, C_r, "gradient-direct-foc"},
    {Gradient, Diffuse, Zoc, 0, 0, How::Given, Form::Monomials, r, none, Opposite},
    {Gradient, Diffuse, Foc, 1, 1, How::Moments, Form::Monomials, B_r, "gradient-diffuse-zoc"},
    {Gradient, Diffuse, Soc, 2, 2, How::Moments, Form::Monomials, C_r, "gradient-diffuse-foc"},
    {Gradient, DiffuseNs, Zoc, 0, 0, How::Given, Form::Monomials, r, none, Opposite},
    {Gradient, DiffuseNs, Foc, 1, 1, How::Moments, Form::Monomials, B_r, "gradient-diffuse-ns-zoc"},
    {Gradient, DiffuseNs, Soc, 2, 2, How::Moments, Form::Monomials, C_r, "gradient-diffuse-ns-foc"},
    {Laplacian, Direct, Zoc, 0, 0, How::Given, Form::Constant, none, none, Same},
    {Laplacian, Direct, Soc, 2, 2, How::Moments, Form::Directions, C_e, "laplacian-direct-zoc"},
    {Laplacian, Diffuse, Zoc, 0, 0, How::Given, Form::Constant, none, none, Same},
    {Laplacian, Diffuse, Soc, 2, 2, How::Moments, Form::Directions, C_e, "laplacian-diffuse-zoc"},
    {Laplacian, DiffuseNs, Zoc, 0, 0, How::Given, Form::Constant, none, none, Same},
    {Laplacian, DiffuseNs, Soc, 2, 2, How::Moments, Form::Directions, C_e, "laplacian-diffuse-ns-zoc"},
    {Laplacian, Mixed, Zoc, 0, 0, How::Given, Form::Constant, none, none, Same},
    {Laplacian, Mixed, Soc, 2, 2, How::Moments, Form::Directions, C_e, "laplacian-mixed-zoc"},
    {Laplacian, Diffuse, SocLs, 2, 2, How::LeastSquares, Form::Monomials, c_p, "laplacian-diffuse-zoc"},
    {Laplacian, DiffuseNs, SocLs, 2, 2, How::LeastSquares, Form::Monomials, c_p, "laplacian-diffuse-ns-zoc"},
    {Laplacian, Mixed, SocLs, 2, 2, How::LeastSquares, Form::Monomials, c_p, "laplacian-mixed-zoc"},
    {Laplacian, Distance, Positive, 2, 2, How::Programme, Form::Monomials, psi, "laplacian-mixed-zoc",
     Any, true},
    {Gradient, W, LeastSquares, 1, highest_degree, How::LeastSquares, Form::Monomials, c_p,
     "gradient-direct-zoc", Any, true},
    {Laplacian, W, LeastSquares, 2, highest_degree, How::LeastSquares, Form::Monomials, c_p,
     "laplacian-mixed-zoc", Any, true},
    {Hessian, Direct, Zoc, 0, 0, How::Given, Form::Directions, ee, none, Same},
    {Hessian, Direct, Soc, 2, 2, How::Moments, Form::Directions, C_e, "hessian-direct-zoc"},
    {Hessian, Diffuse, Zoc, 0, 0, How::Given, Form::Directions, ee, none, Same},
    {Hessian, Diffuse, Soc, 2, 2, How::Moments, Form::Directions, C_e, "hessian-diffuse-zoc"},
    {Hessian, DiffuseNs, Soc, 2, 2, How::Moments, Form::Directions, C_e, none},
    {Hessian, Mixed, Zoc, 0, 0, How::Given, Form::Directions, ee, none, Same},
    {Hessian, Mixed, Soc, 2, 2, How::Moments, Form::Directions, C_e, "hessian-mixed-zoc"},
    {Hessian, Diffuse, SocLs, 2, 2, How::LeastSquares, Form::Monomials, c_p, "hessian-diffuse-zoc"},
    {Hessian, DiffuseNs, SocLs, 2, 2, How::LeastSquares, Form::Monomials, c_p, none},
    {Hessian, Mixed, SocLs, 2, 2, How::LeastSquares, Form::Monomials, c_p, "hessian-mixed-zoc"},
    {Hessian, W, LeastSquares, 2, highest_degree, How::LeastSquares, Form::Monomials, c_p,
     "hessian-mixed-zoc", Any, true},
    // What the paper cites.
    {Gradient, Direct, Consistency::Symmetric, -1, -1, How::Given, Form::Monomials, plus, none, Opposite,
     false, false, {}, 0, +1, "none; conserves"},
    {Gradient, Direct, Normalized, 0, 0, How::Normalized, Form::Monomials, own_r, "gradient-direct-zoc",
     Any, false, false, {}, 0, -1, "row sums 0, diagonal of [4] only"},
    {Gradient, Derivatives, Fpm, 1, 1, How::Moments, Form::KernelDerivatives, c_g, "gradient-direct-zoc",
     Any, false, true},
    {Gradient, W, Mls, 1, highest_degree, How::LeastSquares, Form::Monomials, c_centred, "gradient-direct-zoc",
     Any, true, true},
    {Gradient, Derivatives, Msph, 2, 2, How::Moments, Form::KernelDerivatives, c_t_centred, "gradient-fpm",
     Any, false, true},
    {Gradient, W, Rkpm, 1, 2, How::ShapeFunctions, Form::Monomials, N, "gradient-direct-zoc", Any, true},
    {Laplacian, Mixed, Morris, 0, 0, How::Given, Form::Constant, damped, none, Same, false, false, {}, 1.0 / 400},
    {Laplacian, Derivatives, Cspm, 1, 1, How::Moments, Form::KernelDerivatives, c_W, "laplacian-mixed-zoc",
     Any, false, false, "gradient-direct-foc"},
    {Laplacian, Derivatives, Icspm, 2, 2, How::Moments, Form::KernelDerivatives, c_t, "laplacian-mixed-zoc"},
    {Laplacian, Derivatives, Msph, 2, 2, How::Moments, Form::KernelDerivatives, c_t_centred,
     "laplacian-mixed-zoc", Any, false, true},
    {Laplacian, W, Mls, 2, highest_degree, How::LeastSquares, Form::Monomials, c_centred, "laplacian-mixed-zoc",
     Any, true, true},
    {Laplacian, W, Rkpm, 2, 2, How::ShapeFunctions, Form::Monomials, N, "laplacian-mixed-zoc", Any, true},
    {Laplacian, W, Kgf, 1, 1, How::Passes, Form::Monomials, GG, none, Any, false, false, "gradient-mls-1"},
    {Laplacian, Diffuse, KgfImproved, 1, 1, How::Shepard, Form::Constant, over_W, "laplacian-mixed-zoc",
     Any, false, false, "gradient-mls-1"},
    {Hessian, Derivatives, Icspm, 2, 2, How::Moments, Form::KernelDerivatives, c_t, "hessian-mixed-zoc"},
    {Hessian, Derivatives, Msph, 2, 2, How::Moments, Form::KernelDerivatives, c_t_centred, "hessian-mixed-zoc",
     Any, false, true},
    {Hessian, W, Mls, 2, highest_degree, How::LeastSquares, Form::Monomials, c_centred, "hessian-mixed-zoc",
     Any, true, true},
    {Hessian, W, Rkpm, 2, 2, How::ShapeFunctions, Form::Monomials, N, "hessian-mixed-zoc", Any, true},
    {Value, W, Mls, 0, highest_degree, How::LeastSquares, Form::Monomials, c_value, none, Any, true, true},
    // clang-format on
});

/// How schemes of a consistency are called.
struct Naming {
  std::string_view name;
  bool weight, degree;  // whether theirs are part of it
};

// In the order of Consistency.
constexpr std::array<Naming, 17> namings = {{{"zoc", true, false},
                                             {"foc", true, false},
                                             {"soc", true, false},
                                             {"soc-ls", true, false},
                                             {"positive", false, false},
                                             {"ls", false, true},
                                             {"symmetric", false, false},
                                             {"morris", false, false},
                                             {"normalized", false, false},
                                             {"fpm", false, false},
                                             {"mls", false, true},
                                             {"msph", false, false},
                                             {"cspm", false, false},
                                             {"icspm", false, false},
                                             {"rkpm", false, true},
                                             {"kgf", false, false},
                                             {"kgf-improved", false, false}}};

const Naming& naming(Consistency consistency) {
  return namings.at(static_cast<std::size_t>(consistency));
}

}  // namespace

std::span<const Recipe> recipes() { return table; }

std::string_view name(Consistency consistency) { return naming(consistency).name; }

bool named_by_weight(Consistency consistency) { return naming(consistency).weight; }

bool named_by_degree(Consistency consistency) { return naming(consistency).degree; }

}  // namespace gradpsi
