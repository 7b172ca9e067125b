#pragma once

#include <Eigen/Core>
#include <gradpsi/gradpsi.hpp>

namespace gradpsi {

struct OracleRow {
  Eigen::MatrixXd weights;      // matrices x n
  double reciprocal_condition;  // of the moment system in units of h, 1-norm; 1 for zoc
};

/// Row i of a scheme of at most second order by the letter of its definition: in lengths, not scaled; in long
/// double, with a rank-revealing solver; every pair of points looked at, in a periodic box its nearest image.
OracleRow oracle_row(const Scheme& scheme, const Cloud& cloud, double h, int i,
                     const Kernel& kernel);

/// Whether it knows the scheme: not positive, nor derivatives of shape functions, nor two passes.
bool has_oracle(const Scheme& scheme);

/// The same for one of the systems that the paper cites; the condition number is that of the paper's system, its
/// rows and columns scaled. Without a moment system 1.
OracleRow cited_row(const Scheme& scheme, const Cloud& cloud, double h, int i,
                    const Kernel& kernel);
bool is_cited(const Scheme& scheme);

}  // namespace gradpsi
