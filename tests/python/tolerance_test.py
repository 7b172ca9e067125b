"""Rows chosen to a tolerance."""

import numpy as np
import pytest

import gradpsi
from conftest import square


def waves(cloud, length, count=40):
    """Wave vectors of that length and some longer, (count, 2)."""
    angle = np.linspace(0, np.pi, count, endpoint=False)
    size = 2 * np.pi / length * np.where(np.arange(count) % 2, 1, 0.6)
    return size[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def test_a_laplacian_is_as_good_on_waves_as_it_says():
    cloud = square(20)
    length = 14 * cloud.spacing()
    op = gradpsi.assemble_to("laplacian", cloud, tolerance=0.05, wavelength=length, on_miss="lower")
    assert {s.name for s in op.rows.schemes} > {"laplacian-positive", "laplacian-ls-3"}
    for k in waves(cloud, length):
        wave = np.exp(1j * cloud.positions @ k)
        off = np.abs(op.matrix @ wave + (k @ k) * wave) / (2 * np.pi / length) ** 2
        assert np.all(off <= op.rows.errors)
    again = gradpsi.certified_errors("laplacian", cloud, op, length)
    np.testing.assert_array_equal(again, op.rows.errors)
    one_scheme = gradpsi.assemble("laplacian-ls-4", cloud, gradpsi.find_neighbours(cloud, 3 * cloud.spacing()),
                                  on_degenerate="widen")
    assert op.matrix.nnz < one_scheme.matrix.nnz
    assert one_scheme.rows.schemes == [] and one_scheme.rows.errors.size == 0


def test_steps_that_must_not_grow():
    cloud = square(16)
    walls = np.any((cloud.positions < 1 / 16) | (cloud.positions > 15 / 16), axis=1)
    op = gradpsi.assemble_to("laplacian", cloud, tolerance=0.05, wavelength=1, stable=True, fixed=walls)
    inside = op.matrix[~walls][:, ~walls].toarray()
    assert np.linalg.eigvals(inside).real.max() < 0


def test_rows_that_miss_it():
    cloud = square(12)
    with pytest.raises(gradpsi.StencilError, match="all rows meet a tolerance of"):
        gradpsi.assemble_to("gradient", cloud, tolerance=1e-12, wavelength=1)
    op = gradpsi.assemble_to("gradient", cloud, tolerance=1e-12, wavelength=1, on_miss="zero")
    assert op.matrix.count_nonzero() == 0 and op.rows.schemes[0] is None
    for bad in [{"tolerance": -1, "wavelength": 1}, {"tolerance": 1, "wavelength": [1, 2]}]:
        with pytest.raises(gradpsi.InvalidInput):
            gradpsi.assemble_to("gradient", cloud, **bad)
    with pytest.raises(gradpsi.InvalidInput, match="rows of a value are not chosen"):
        gradpsi.assemble_to("value", cloud, tolerance=1, wavelength=1)
