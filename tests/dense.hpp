#pragma once

#include <Eigen/Core>

// Dense linear algebra to compare with. Eigen's templates for it are compiled once.
namespace gradpsi {

Eigen::MatrixXd dense_product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

/// By elimination with full pivoting.
Eigen::MatrixXd dense_inverse(const Eigen::MatrixXd& A);

/// x of A x = b, by elimination with full pivoting; empty if A is singular to rounding.
Eigen::MatrixXd dense_solution(const Eigen::MatrixXd& A, const Eigen::MatrixXd& b);

/// Of a symmetric matrix, ascending.
Eigen::VectorXd dense_eigenvalues(const Eigen::MatrixXd& symmetric);

/// P c, with the c of the least |P c - b|.
Eigen::VectorXd least_squares_fit(const Eigen::MatrixXd& P, const Eigen::VectorXd& b);

}  // namespace gradpsi
