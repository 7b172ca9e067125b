"""Row reports, spectra and forecasts from Python."""

import gc
import math

import numpy as np
import pytest
import scipy.linalg

import gradpsi
from conftest import edge, operator, square


def test_amplification_is_the_sum_of_weights():
    cloud = square()
    op = operator("laplacian-mixed-soc", cloud)
    rows = gradpsi.diagnose("laplacian-mixed-soc", cloud, op)
    A = op.matrix.copy()
    A.setdiag(0)
    expected = cloud.volumes * np.ravel(np.abs(A).sum(axis=1))
    assert np.allclose(rows.amplification, expected, rtol=1e-12)
    negative = np.array([(A.data[a:b] < 0).sum() for a, b in zip(A.indptr, A.indptr[1:])])
    assert np.allclose(rows.negative_share, negative / op.rows.neighbours)
    assert rows.residuals.shape == (144, 5) and rows.remainders.shape == (144, 6)
    # The promised conditions leave rounding, the degree beyond them does not.
    assert rows.residuals[:, 1:3].max() < 1e-8 < rows.residuals[:, 3].max()


def test_columns_are_degrees():
    """sum_j |a_ij| r^k / k!, literally; catches a transposed array."""
    cloud = square(6)
    op = operator("gradient-direct-foc", cloud)
    rows = gradpsi.diagnose(gradpsi.Scheme("gradient-direct-foc"), cloud, op)
    x = cloud.positions
    r = np.linalg.norm(x[:, None] - x, axis=2)
    for k in range(rows.remainders.shape[1]):
        each = [(np.abs(A.toarray()) * (r > 0) * r**k / math.factorial(k)).sum(axis=1) for A in op.axes]
        assert np.allclose(rows.remainders[:, k], np.max(each, axis=0), rtol=1e-12)


def test_errors_are_below_their_bound():
    cloud = square(20)
    op = operator("laplacian-mixed-soc", cloud)
    rows = gradpsi.diagnose("laplacian-mixed-soc", cloud, op)
    wave = 3.0
    x = cloud.positions[:, 0]
    error = np.abs(op.matrix @ np.sin(wave * x) + wave**2 * np.sin(wave * x))
    bound = gradpsi.error_bound(rows, wave ** np.arange(6))
    assert np.all(error <= bound) and np.median(bound / error) < 1e3
    each = np.tile(wave ** np.arange(6), (400, 1))
    assert np.array_equal(gradpsi.error_bound(rows, each), bound)
    with pytest.raises(gradpsi.InvalidInput):
        gradpsi.error_bound(rows, [1, 2, 3])


def test_arrays_keep_diagnoses_and_spectra_alive():
    cloud = square()
    op = operator("laplacian-mixed-zoc", cloud)
    rows = gradpsi.diagnose("laplacian-mixed-zoc", cloud, op)
    spectrum = gradpsi.spectrum(op.matrix, op.volumes)
    held = [rows.amplification, rows.residuals, spectrum.values]
    copies = [x.copy() for x in held]
    del rows, spectrum
    gc.collect()
    assert all(np.array_equal(x, copy) for x, copy in zip(held, copies))


def test_spectra_are_those_of_scipy():
    cloud = square(16)
    op = operator("laplacian-mixed-soc-ls", cloud)
    free = ~edge(cloud)
    A = op.matrix[free][:, free]
    spectrum = gradpsi.spectrum(A)
    expected = scipy.linalg.eigvals(A.toarray())
    assert spectrum.complete and len(spectrum.values) == free.sum()
    scale = np.abs(expected).max()
    assert np.allclose(np.sort(spectrum.values.real), np.sort(expected.real), atol=1e-8 * scale)
    assert spectrum.rightmost == pytest.approx(expected.real.max(), abs=1e-8 * scale)
    assert spectrum.leftmost == pytest.approx(expected.real.min(), abs=1e-8 * scale)
    assert spectrum.widest == pytest.approx(expected.imag.max(), abs=1e-8 * scale)
    assert not spectrum.grows and spectrum.zero > 0
    ends = gradpsi.spectrum(A, op.volumes[free], complete_below=100)
    assert not ends.complete
    assert ends.leftmost == pytest.approx(spectrum.leftmost, rel=1e-5)


def test_the_largest_stable_step_is_the_textbook_one():
    cloud = gradpsi.lattice(30, dimension=1, periodic=True)
    op = operator("laplacian-mixed-zoc", cloud, 2.5)
    spectrum = gradpsi.spectrum(op.matrix, op.volumes)
    euler = gradpsi.largest_stable_step(spectrum, "euler")
    assert euler == pytest.approx(-2 / spectrum.leftmost, rel=1e-9)
    assert gradpsi.largest_stable_step(spectrum, "runge-kutta-4") / euler == pytest.approx(2.785 / 2, rel=1e-3)
    with pytest.raises(gradpsi.InvalidInput, match="unknown stepper 'rk4'"):
        gradpsi.largest_stable_step(spectrum, "rk4")


def test_positive_eigenvalues_make_steps_singular():
    spectrum = gradpsi.spectrum(np.diag([2.0, -1.0, 4.0]))
    assert gradpsi.singular_steps(spectrum) == pytest.approx([0.25, 0.5])
    assert spectrum.grows and gradpsi.largest_stable_step(spectrum, "euler") == 0


def test_matrices_are_summarised_by_their_entries():
    cloud = square()
    zoc, soc = gradpsi.assemble(
        ["laplacian-mixed-zoc", "laplacian-mixed-soc"],
        cloud,
        gradpsi.find_neighbours(cloud, 0.25),
    )
    summary = gradpsi.summarise(zoc.matrix, zoc.volumes)
    assert summary.symmetric and summary.dominant and summary.m_matrix
    assert summary.solver == "cholesky"
    row, column = zoc.matrix.nonzero()
    assert summary.bandwidth == np.abs(row - column).max()
    assert summary.leftmost == pytest.approx(2 * zoc.matrix.diagonal().min())
    assert summary.rightmost == pytest.approx(0, abs=1e-8)
    summary = gradpsi.summarise(soc.matrix, soc.volumes)
    assert not summary.symmetric and not summary.m_matrix and summary.solver == "lu"
    with pytest.raises(gradpsi.InvalidInput):
        gradpsi.summarise(zoc.matrix, zoc.volumes[1:])


def test_forecasts_tell_what_spectra_show():
    cloud = square(14, 0.3)
    for scheme, points in [
        ("laplacian-mixed-zoc", np.ones(196, bool)),
        ("laplacian-mixed-soc-ls", ~edge(cloud)),
        ("laplacian-direct-soc", np.ones(196, bool)),
    ]:
        op = operator(scheme, cloud)
        forecast = gradpsi.forecast(cloud, op.matrix, points, op.volumes)
        part = gradpsi.spectrum(op.matrix[points][:, points], op.volumes[points])
        assert forecast.grows == part.grows
        assert (forecast.point >= 0) == forecast.grows and (forecast.rate > 0) == forecast.grows
    assert forecast.grows  # the last one: both outcomes are seen
