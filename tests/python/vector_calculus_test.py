"""Operators on fields of vectors, beside numpy's own arithmetic with scipy's matrices."""

import numpy as np
import pytest

import gradpsi
from conftest import same, square


def operators(dimension=2, n=12):
    cloud = gradpsi.lattice(n, dimension=dimension, jitter=0.2)
    near = gradpsi.find_neighbours(cloud, 2.6 * cloud.spacing())
    gradient, hessian = gradpsi.assemble(["gradient-ls-2", "hessian-ls-2"], cloud, near)
    return cloud, gradient, hessian


def literal(what, op, v):
    """By the definitions, with scipy's products."""
    A, d = op.axes, v.shape[1]
    if what == "divergence":
        return sum(A[a] @ v[:, a] for a in range(d))
    if what == "curl":
        turn = [A[a] @ v[:, b] - A[b] @ v[:, a] for a, b in [(1, 2), (2, 0), (0, 1)] if max(a, b) < d]
        return turn[0] if d == 2 else np.stack(turn, 1)
    if what == "velocity-gradient":
        return np.stack([A[b] @ v[:, a] for a in range(d) for b in range(d)], 1)
    if what == "strain":
        return np.stack([(A[b] @ v[:, a] + A[a] @ v[:, b]) / 2 for a in range(d) for b in range(a, d)], 1)
    H = {}
    for a in range(d):
        for b in range(a, d):
            H[a, b] = H[b, a] = A[len({frozenset(pair) for pair in H})]
    return np.stack([sum(H[a, b] @ v[:, b] for b in range(d)) for a in range(d)], 1)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("what", ["divergence", "curl", "velocity-gradient", "strain", "grad-div"])
def test_both_forms_are_the_definition(what, dimension):
    cloud, gradient, hessian = operators(dimension, 12 if dimension == 2 else 7)
    op = hessian if what == "grad-div" else gradient
    v = np.random.default_rng(1).random((len(cloud), dimension))
    expected = literal(what, op, v)
    found = gradpsi.vector_derivative(what, op, v)
    assert found.shape == expected.shape
    size = np.abs(expected).max()
    assert np.allclose(found, expected, rtol=0, atol=1e-12 * size)
    assert np.array_equal(found, gradpsi.vector_derivative(what, op, v, threads=1))
    stacked = gradpsi.block_matrix(what, op) @ v.T.ravel()
    assert np.allclose(stacked, expected.T.ravel(), rtol=0, atol=1e-12 * size)


def test_two_passes_are_products_of_blocks():
    cloud, gradient, _ = operators()
    x, y = cloud.positions.T
    grad_div = gradpsi.block_matrix("gradient", gradient) @ gradpsi.block_matrix("divergence", gradient)
    assert np.allclose(grad_div @ np.concatenate([x * y, y * y]), np.repeat([0, 3], len(cloud)), atol=1e-8)
    assert same(gradpsi.block_matrix("gradient", gradient)[: len(cloud)].tocsr(), gradient.axes[0])


def test_viscous_force_of_a_varying_viscosity():
    cloud, gradient, hessian = operators()
    x, y = cloud.positions.T
    force = gradpsi.viscous_force(hessian, gradient, 1 + x)
    # tau = (1 + x) [[0, 1], [1, 0]] of v = (y, 0): its divergence is (0, 1).
    assert np.allclose(force @ np.concatenate([y, 0 * y]), np.repeat([0, 1], len(cloud)), atol=1e-8)
    with pytest.raises(gradpsi.InvalidInput, match="point 0 must be >= 0"):
        gradpsi.viscous_force(hessian, gradient, x - 1)


def test_the_companion_conserves_momentum_and_is_the_adjoint():
    cloud, gradient, _ = operators()
    random = np.random.default_rng(1)
    p, v = random.random(len(cloud)), random.random((len(cloud), 2))
    force = np.stack([A @ p for A in gradpsi.conservative_companion(gradient)], 1)
    omega = gradient.volumes
    size = omega @ np.abs(force).sum(1)
    assert np.all(np.abs(omega @ force) < 1e-13 * size)
    divergence = gradpsi.vector_derivative("divergence", gradient, v)
    assert abs(omega @ np.sum(v * force, 1) + omega @ (divergence * p)) < 1e-13 * size


def test_conductivity_by_the_product_rule():
    cloud = square()
    near = gradpsi.find_neighbours(cloud, 2.6 * cloud.spacing())
    laplacian, gradient = gradpsi.assemble(["laplacian-ls-2", "gradient-ls-2"], cloud, near)
    x, y = cloud.positions.T
    flux = gradpsi.with_conductivity(laplacian, 1 + x * x, gradient=gradient).matrix
    assert np.allclose(flux @ (x * x + y), 2 * (1 + x * x) + 4 * x * x, atol=1e-8)
    with pytest.raises(gradpsi.InvalidInput, match="takes no mean"):
        gradpsi.with_conductivity(laplacian, 1 + x, "harmonic", gradient=gradient)


def test_what_does_not_fit_is_refused():
    cloud, gradient, hessian = operators()
    v = np.zeros((len(cloud), 2))
    for arguments, words in [
        (("divergenc", gradient, v), "unknown vector operator 'divergenc'; valid: divergence, "),
        (("divergence", gradient, v[:, 0]), "takes fields of 2 components, not 1"),
        (("curl", hessian, v), "in 3D takes fields of 3 components, not 2"),
        (("grad-div", gradient, v), "takes 1, 3 or 6 matrices, not 2"),
        (("divergence", gradient, v[1:]), "143 entries for 144 columns"),
    ]:
        with pytest.raises(gradpsi.InvalidInput, match=words):
            gradpsi.vector_derivative(*arguments)


def test_vtu_files_have_vectors(tmp_path):
    meshio = pytest.importorskip("meshio")
    cloud, gradient, _ = operators()
    v = np.random.default_rng(1).random((len(cloud), 2))
    gradpsi.write_vtu(tmp_path / "v.vtu", cloud, {"T": v[:, 0], "v": v})
    data = meshio.read(tmp_path / "v.vtu").point_data
    assert np.array_equal(data["v"], np.column_stack([v, 0 * v[:, 0]]))
    assert np.array_equal(data["v_y"], v[:, 1]) and np.array_equal(data["T"], v[:, 0])
    with pytest.raises(gradpsi.InvalidInput, match="v has 4 components"):
        gradpsi.write_vtu(tmp_path / "w.vtu", cloud, {"v": np.zeros((len(cloud), 4))})
