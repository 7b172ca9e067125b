#pragma once

/// @namespace gradpsi
/// Clouds of points as sparse matrices: cloud -> neighbours -> assemble -> multiply, solve or write.
///
/// Everything is a plain value or a free function but LinearSolver, ImplicitDiffusion and Poisson, which keep a
/// factorisation or coarser points. Arguments are checked before any work is done; errors are InvalidInput,
/// StencilError and SolverError, std::system_error for files and std::bad_alloc. Functions may be called from several
/// threads at a time, on the same arguments as long as none of them changes these.
///
/// A program may be compiled with any -m and -march, with EIGEN_MAX_ALIGN_BYTES or EIGEN_DONT_VECTORIZE,
/// whatever the library was compiled with: memory that passes between them follows one rule (dense.hpp).
/// With Eigen 5 the two must agree, or the program does not link (matrix.hpp).
#include "gradpsi/assemble.hpp"
#include "gradpsi/cited.hpp"
#include "gradpsi/cloud.hpp"
#include "gradpsi/dense.hpp"
#include "gradpsi/diffusion.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/interpolate.hpp"
#include "gradpsi/io.hpp"
#include "gradpsi/kernel.hpp"
#include "gradpsi/matrix.hpp"
#include "gradpsi/neighbours.hpp"
#include "gradpsi/operator.hpp"
#include "gradpsi/poisson.hpp"
#include "gradpsi/rows.hpp"
#include "gradpsi/scheme.hpp"
#include "gradpsi/solver.hpp"
#include "gradpsi/solver_options.hpp"
#include "gradpsi/spectrum.hpp"
#include "gradpsi/spmv.hpp"
#include "gradpsi/system.hpp"
#include "gradpsi/table.hpp"
#include "gradpsi/tolerance.hpp"
#include "gradpsi/vector_calculus.hpp"
#include "gradpsi/walls.hpp"
