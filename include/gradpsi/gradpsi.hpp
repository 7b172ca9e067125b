#pragma once

/// @namespace gradpsi
/// Clouds of points as sparse matrices: cloud -> neighbours -> assemble -> multiply, solve or write.
///
/// Everything is a plain value or a free function but LinearSolver and ImplicitDiffusion, which keep a
/// factorisation. Arguments are checked before any work is done; errors are InvalidInput, StencilError and
/// SolverError, std::system_error for files and std::bad_alloc. Functions may be called from several threads
/// at a time, on the same arguments as long as none of them changes these.
#include "gradpsi/assemble.hpp"
#include "gradpsi/cloud.hpp"
#include "gradpsi/diffusion.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/io.hpp"
#include "gradpsi/kernel.hpp"
#include "gradpsi/matrix.hpp"
#include "gradpsi/neighbours.hpp"
#include "gradpsi/operator.hpp"
#include "gradpsi/rows.hpp"
#include "gradpsi/scheme.hpp"
#include "gradpsi/solver.hpp"
#include "gradpsi/spectrum.hpp"
#include "gradpsi/spmv.hpp"
#include "gradpsi/system.hpp"
