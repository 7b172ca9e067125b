"""Points, neighbours, kernels and schemes from Python."""

import gc
import os
import subprocess
import sys

import numpy as np
import pytest
import scipy.integrate
import scipy.spatial

import gradpsi
from conftest import REFERENCE, address, square

X = np.random.default_rng(1).random((50, 2))


@pytest.mark.parametrize(
    "given",
    [
        X,
        X.tolist(),
        [tuple(row) for row in X],
        np.asfortranarray(X),
        np.repeat(X, 2, axis=1)[:, ::2],
        X[::-1][::-1],
        X.astype(np.longdouble),
        X.astype(">f8"),
    ],
    ids=["array", "list", "tuples", "fortran", "strided", "reversed", "longdouble", "big-endian"],
)
def test_positions_of_any_layout_are_taken(given):
    assert np.array_equal(gradpsi.Cloud(given).positions, X)


def test_integers_and_single_precision_are_taken():
    assert np.array_equal(gradpsi.Cloud([[0, 1], [2, 3]]).positions, [[0.0, 1.0], [2.0, 3.0]])
    single = X.astype(np.float32)
    assert np.array_equal(gradpsi.Cloud(single).positions, single.astype(float))


def test_one_dimensional_arrays_are_points_on_a_line():
    cloud = gradpsi.Cloud([0.0, 0.5, 2.0])
    assert (len(cloud), cloud.dimension) == (3, 1)
    assert cloud.positions.shape == (3, 1)


@pytest.mark.parametrize("shape", [(0,), (0, 1), (0, 2), (0, 3)])
def test_no_points_give_empty_matrices(shape):
    cloud = gradpsi.Cloud(np.zeros(shape))
    near = gradpsi.find_neighbours(cloud, 1.0)
    A = gradpsi.assemble("laplacian-mixed-zoc", cloud, near).matrix
    assert A.shape == (0, 0) and A.nnz == 0
    assert len(cloud) == len(near) == 0


def test_a_cloud_owns_what_it_was_given():
    mine = X.copy()
    cloud = gradpsi.Cloud(mine)
    mine[:] = 0
    assert np.array_equal(cloud.positions, X)
    with pytest.raises(ValueError, match="read-only"):
        cloud.positions[0, 0] = 1


def test_arrays_keep_the_cloud_alive():
    cloud = gradpsi.Cloud(X, volumes=np.ones(50))
    positions, volumes = cloud.positions, cloud.volumes
    assert address(positions) == address(cloud.positions)  # no copies
    del cloud
    gc.collect()
    assert np.array_equal(positions, X) and np.array_equal(volumes, np.ones(50))


def test_volumes_and_boxes_come_back():
    cloud = gradpsi.Cloud(X, volumes=list(range(1, 51)), box=[2, 0])
    assert np.array_equal(cloud.volumes, np.arange(1.0, 51))
    assert cloud.box == (2.0, 0.0)
    assert cloud.spacing() == pytest.approx(np.sqrt(25.5))
    assert gradpsi.Cloud(X).volumes is None
    assert "50 points in 2D" in repr(cloud)


@pytest.mark.parametrize(
    "arguments, words",
    [
        (dict(positions=np.zeros((2, 2, 2))), r"positions must be n or n x d numbers.*\(2, 2, 2\)"),
        (dict(positions=np.zeros((2, 4))), "4"),
        (dict(positions=3.0), r"positions must be n or n x d numbers, not of shape \(\)"),
        (dict(positions=[[0, 1], [np.nan, 2]]), "point 1"),
        (dict(positions=[[0, 1], [np.inf, 2]]), "point 1"),
        (dict(positions=[[0, 1j]]), "positions must be real numbers, not of type complex128"),
        (dict(positions=[["0", "1"]]), "positions must be real numbers"),
        (dict(positions=None), "positions must be real numbers"),
        (dict(positions=X, volumes=np.ones(49)), "volumes has 49 entries, expected 50"),
        (dict(positions=X, volumes=[]), "volumes has 0 entries, expected 50"),
        (dict(positions=X, volumes=-np.ones(50)), "point 0"),
        (dict(positions=X, volumes=np.full(50, np.nan)), "point 0"),
        (dict(positions=X, volumes=np.ones((50, 1))), r"volumes must be n numbers.*\(50, 1\)"),
        (dict(positions=X, box=[1, 1, 1]), "box has 3 entries, expected 2"),
        (dict(positions=X, box=[-1, 0]), "box"),
    ],
)
def test_bad_clouds_are_refused_by_name(arguments, words):
    with pytest.raises(gradpsi.InvalidInput, match=words):
        gradpsi.Cloud(**arguments)


def test_lattices_are_those_of_the_program():
    cloud = gradpsi.lattice(4, dimension=3, lower=-1, upper=1)
    assert len(cloud) == 64 and np.allclose(cloud.volumes, 0.125)
    assert np.allclose(cloud.positions[:5, 2], [-0.75, -0.25, 0.25, 0.75, -0.75])
    assert gradpsi.lattice(4, dimension=1, periodic=True).box == (1.0,)
    again = [gradpsi.lattice(5, jitter=0.2, seed=seed).positions for seed in (1, 1, 2)]
    assert np.array_equal(again[0], again[1]) and not np.array_equal(again[0], again[2])
    with pytest.raises(gradpsi.InvalidInput):
        gradpsi.lattice(0)


@pytest.mark.parametrize("varying", [False, True])
def test_neighbours_are_those_that_scipy_finds(varying):
    supports = np.random.default_rng(2).uniform(0.2, 0.4, 50) if varying else 0.3
    near = gradpsi.find_neighbours(gradpsi.Cloud(X), supports)
    tree = scipy.spatial.cKDTree(X)
    for i, found in enumerate(tree.query_ball_point(X, supports)):
        found = sorted(set(found) - {i})
        assert near.of(i).tolist() == found
        assert near.indices[near.offsets[i] : near.offsets[i + 1]].tolist() == found
    assert np.array_equal(near.supports, np.atleast_1d(supports))
    assert sorted(near.order) in ([], list(range(50)))
    with pytest.raises(IndexError):
        near.of(50)
    with pytest.raises(IndexError):
        near.of(-1)


def test_arrays_keep_the_neighbours_alive():
    near = gradpsi.find_neighbours(gradpsi.Cloud(X), 0.3)
    first, indices, copy = near.of(0), near.indices, near.indices.copy()
    assert address(indices) == address(near.indices)
    del near
    gc.collect()
    assert np.array_equal(indices, copy) and np.array_equal(first, copy[: len(first)])
    with pytest.raises(ValueError, match="read-only"):
        indices[0] = 10**9


@pytest.mark.parametrize("support", [0, -1, np.nan, np.inf])
def test_supports_out_of_range_are_refused(support):
    with pytest.raises(gradpsi.InvalidInput):
        gradpsi.find_neighbours(gradpsi.Cloud(X), support)


@pytest.mark.parametrize("support", [[0.3] * 49, [[0.3] * 50], "0.3", None, 1j])
def test_supports_of_another_kind_are_refused(support):
    with pytest.raises(gradpsi.InvalidInput):
        gradpsi.find_neighbours(gradpsi.Cloud(X), support)


def test_coincident_points_are_named_and_found():
    doubled = np.vstack([X, X[3:5]])
    with pytest.raises(gradpsi.InvalidInput, match="3 and 50|50 and 3"):
        gradpsi.find_neighbours(gradpsi.Cloud(doubled), 0.3)
    kept = gradpsi.distinct_points(gradpsi.Cloud(doubled))
    assert kept.tolist() == list(range(50))


def test_reordered_points_are_the_same_points():
    cloud = gradpsi.Cloud(X, volumes=np.arange(1.0, 51))
    reordered, order = gradpsi.reorder(cloud)
    assert sorted(order) == list(range(50))
    assert np.array_equal(reordered.positions, X[order])
    assert np.array_equal(reordered.volumes, cloud.volumes[order])


def test_distances_and_volumes_agree_with_their_definitions():
    cloud = gradpsi.Cloud(X)
    distances = scipy.spatial.cKDTree(X).query(X, 2)[0][:, 1]
    assert np.allclose(gradpsi.nearest_distances(cloud), distances, rtol=1e-14)
    assert cloud.spacing() == pytest.approx(np.median(distances), rel=1e-14)
    h = 0.3
    near = gradpsi.find_neighbours(cloud, h)
    r = scipy.spatial.distance.cdist(X, X)
    for kernel in gradpsi.kernels():
        w = gradpsi.kernel_values(kernel, 2, h, np.minimum(r, h).ravel())[0].reshape(r.shape)
        volumes = gradpsi.number_density_volumes(cloud, near, kernel)
        assert np.allclose(volumes, 1 / w.sum(axis=1), rtol=1e-13)


def test_kernels_integrate_to_one_and_slopes_are_theirs():
    h = 0.7
    r = np.linspace(0, h, 20001)
    for kernel in gradpsi.kernels():
        w, dw_over_r, d2w = gradpsi.kernel_values(kernel, 3, h, r)
        assert scipy.integrate.trapezoid(4 * np.pi * r**2 * w, r) == pytest.approx(1, rel=1e-6)
        assert np.allclose(np.gradient(w, r)[1:-1], (dw_over_r * r)[1:-1], atol=1e-6 * w[0] / h)
        slope = np.gradient(dw_over_r * r, r)
        # The second derivative of splines has kinks, whose differences are of first order.
        assert np.allclose(slope[1:-1], d2w[1:-1], atol=5e-3 * np.abs(d2w).max())
    with pytest.raises(gradpsi.InvalidInput, match="unknown kernel 'wendland'; valid: wendland-c"):
        gradpsi.kernel_values("wendland", 3, h, r)


def test_schemes_are_a_table():
    schemes = gradpsi.schemes()
    names = [scheme.name for scheme in schemes]
    assert len(set(names)) == len(names) > 17
    assert [s.derivative for s in schemes[:17]] == ["gradient"] * 9 + ["laplacian"] * 8
    for scheme in schemes:
        assert gradpsi.Scheme(scheme.name) == scheme
        assert hash(gradpsi.Scheme(scheme.name)) == hash(scheme)
        assert scheme.formula and scheme.conditions
        assert -1 <= scheme.degree <= 6
    mixed = gradpsi.Scheme("laplacian-mixed-soc")
    assert (mixed.weight, mixed.consistency, mixed.degree) == ("mixed", "soc", 2)
    assert (mixed.unknowns(2), mixed.support_ratio, mixed.symmetry) == (5, None, "none")
    assert gradpsi.Scheme("gradient-ls-3").support_ratio == 3.5
    assert gradpsi.Scheme("laplacian-mixed-zoc").symmetry == "symmetric"
    assert mixed != "laplacian-mixed-soc" and mixed != schemes[0]
    with pytest.raises(gradpsi.InvalidInput, match="unknown scheme.*valid: laplacian-mixed-soc"):
        gradpsi.Scheme("laplacian-mixed-sok")


def test_clouds_are_read_from_files(tmp_path):
    cloud = gradpsi.read_cloud(REFERENCE / "square.csv")
    table = np.genfromtxt(REFERENCE / "square.csv", delimiter=",", names=True)
    assert np.array_equal(cloud.positions, np.column_stack([table["x"], table["y"]]))
    assert np.array_equal(cloud.volumes, table["volume"])
    assert np.array_equal(gradpsi.read_cloud(str(REFERENCE / "square.csv")).volumes, table["volume"])


def test_a_lattice_in_a_box_has_the_same_neighbours_everywhere():
    cloud = gradpsi.lattice(8, periodic=True)
    near = gradpsi.find_neighbours(cloud, 2.1 * cloud.spacing())
    assert set(np.diff(near.offsets)) == {12}
    assert set(np.diff(gradpsi.find_neighbours(square(8, 0), 2.1 / 8).offsets)) != {12}


@pytest.mark.skipif("asan" in os.environ.get("LD_PRELOAD", ""), reason="sanitizers reserve terabytes")
def test_too_little_memory_is_a_memory_error():
    """In a process that may have 100 MB more than it has; 25 million points take 400. OpenBLAS, whose second
    thread would ask for 128 MB again and again, has one."""
    script = (
        "import gradpsi, resource\n"
        "used = int(open('/proc/self/statm').read().split()[0]) * resource.getpagesize()\n"
        "resource.setrlimit(resource.RLIMIT_AS, (used + 100_000_000,) * 2)\n"
        "try:\n"
        "    gradpsi.lattice(5000)\n"
        "except MemoryError:\n"
        "    print('MemoryError', len(gradpsi.lattice(10)))\n"
    )
    one_thread = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, env=one_thread)
    assert done.stdout == "MemoryError 100\n", done.stderr


def test_the_local_spacing_follows_the_points():
    even = gradpsi.lattice(30, jitter=0.3)
    assert np.array_equal(gradpsi.local_spacing(even), [even.spacing()])
    random = np.random.default_rng(1)
    graded = gradpsi.Cloud(random.random((4000, 2)) ** 3)
    spacing = gradpsi.local_spacing(graded)
    assert spacing.shape == (4000,) and spacing.max() > 10 * spacing.min()
    assert np.all(np.diff(gradpsi.find_neighbours(graded, 6 * spacing).offsets) > 5)
    near = gradpsi.find_neighbours(graded, gradpsi.kth_nearest_distances(graded, 7) * (1 + 1e-9))
    assert np.all(np.diff(near.offsets) == 7)
