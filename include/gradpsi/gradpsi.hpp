#pragma once

// Everything: cloud -> neighbours -> assemble -> multiply, solve or write.
#include "gradpsi/assemble.hpp"
#include "gradpsi/cloud.hpp"
#include "gradpsi/diagnosis.hpp"
#include "gradpsi/diffusion.hpp"
#include "gradpsi/error.hpp"
#include "gradpsi/io.hpp"
#include "gradpsi/kernel.hpp"
#include "gradpsi/neighbours.hpp"
#include "gradpsi/scheme.hpp"
#include "gradpsi/solver.hpp"
#include "gradpsi/spmv.hpp"
