"""Sparse gradient and Laplacian matrices of point clouds, by SPH-like schemes.

    cloud -> neighbours -> assemble -> multiply, solve or write

    >>> import gradpsi
    >>> cloud = gradpsi.Cloud(positions)                      # n x d, d = 1, 2 or 3
    >>> near = gradpsi.find_neighbours(cloud, 3 * cloud.spacing())
    >>> laplacian = gradpsi.assemble("laplacian-mixed-soc", cloud, near)
    >>> laplacian.matrix @ u                                  # a scipy.sparse.csr_matrix

Points count from 0. Lengths are in the unit of the positions. What is array-like is taken: lists, numpy
arrays of any real type and layout. Arrays that are handed out lie in the memory of the C++ objects,
which they keep alive. Long calls let other Python threads run.
"""

from . import _core
from ._core import *  # noqa: F403
from ._core import __version__

__all__ = [name for name in dir(_core) if not name.startswith("_")]
