#include "gradpsi/cited.hpp"

#include <array>

namespace gradpsi {

std::span<const CitedSystem> cited_systems() {
  static constexpr auto all = std::to_array<CitedSystem>({
      {"[4]", "gradient-antisymmetric", "Monaghan, difference of values", "gradient-direct-zoc"},
      {"[4]", "gradient-symmetric", "Monaghan, sum of values", {}},
      {"[5]", "gradient-randles-libersky", "Randles and Libersky", "gradient-direct-foc"},
      {"[6]", "gradient-normalized", "normalized smoothing, axis by axis", {}},
      {"[7]", "laplacian-brookshaw", "Brookshaw", "laplacian-mixed-zoc"},
      {"[8]", "laplacian-morris", "Morris, Fox and Zhu", {}},
      {"[9]", "laplacian-fatehi-manzari", "Fatehi and Manzari", "laplacian-mixed-soc"},
      {"[10]", "gradient-rkpm-1", "RKPM, in full", {}},
      {"[10]", "gradient-rkpm-2", "RKPM, in full", {}},
      {"[10]", "laplacian-rkpm-2", "RKPM, in full", {}},
      {"[10] [11]", "gradient-mls-1", "diffuse RKPM, MLSPH", {}},
      {"[10] [11]", "gradient-mls-2", "diffuse RKPM, MLSPH", {}},
      {"[10] [11]", "laplacian-mls-2", "diffuse RKPM, MLSPH", {}},
      {"[12]", "gradient-cspm", "CSPM", "gradient-direct-foc"},
      {"[12]", "laplacian-cspm", "CSPM", {}},
      {"[13]", "laplacian-icspm", "improved CSPM", {}},
      {"[14] [15]", "gradient-msph", "MSPH, FPM of second order", {}},
      {"[14] [15]", "laplacian-msph", "MSPH, FPM of second order", {}},
      {"[16]", "gradient-fpm", "FPM of first order", {}},
      {"[17]", "gradient-kgf", "KGF-SPH", "gradient-mls-1"},
      {"[17]", "laplacian-kgf", "KGF-SPH, two passes", {}},
      {"[18]", "laplacian-kgf-improved", "KGF-SPH, its Laplacian improved", {}},
      {"[19]", "gradient-kernel-derivative-free", "kernel-derivative-free", "gradient-mls-2"},
      {"[19]", "laplacian-kernel-derivative-free", "kernel-derivative-free", "laplacian-mls-2"},
  });
  return all;
}

}  // namespace gradpsi
