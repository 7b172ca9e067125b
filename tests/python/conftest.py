"""What the tests of the Python module share. CTest sets PYTHONPATH to the build tree."""

import os
from pathlib import Path

import numpy as np
import pytest

import gradpsi

ROOT = Path(__file__).resolve().parents[2]
REFERENCE = ROOT / "tests" / "reference"


def square(n=12, jitter=0.2, seed=1):
    """A jittered lattice on the unit square."""
    return gradpsi.lattice(n, dimension=2, jitter=jitter, seed=seed)


def operator(scheme, cloud, ratio=3.0, **options):
    near = gradpsi.find_neighbours(cloud, ratio * cloud.spacing())
    return gradpsi.assemble(scheme, cloud, near, **options)


def edge(cloud, width=0.1):
    """A mask of the points near the edge of the unit square."""
    x = cloud.positions
    return np.any((x < width) | (x > 1 - width), axis=1)


def address(array):
    return array.__array_interface__["data"][0]


def same(a, b):
    """The same entries in the same places, to the last bit."""
    return (
        a.shape == b.shape
        and np.array_equal(a.indptr, b.indptr)
        and np.array_equal(a.indices, b.indices)
        and np.array_equal(a.data, b.data)
    )


@pytest.fixture(scope="session")
def program():
    path = os.environ.get("GRADPSI_PROGRAM")
    if not path:
        pytest.skip("the program was not built")
    return path
