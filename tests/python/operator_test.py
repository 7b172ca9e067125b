"""Matrices: the right ones, without copies, for as long as they are held."""

import csv
import gc
import subprocess

import numpy as np
import pytest
import scipy.io
import scipy.sparse
import scipy.sparse.csgraph
import scipy.sparse.linalg

import gradpsi
from conftest import REFERENCE, address, operator, same, square

# Cloud, support, condition number of its worst moment system: reference/README.md.
CASES = [
    ("line", 0.10416666666666666, 9e2),
    ("square", 0.3571428571428571, 2e5),
    ("cube", 0.575, 2e6),
]


@pytest.mark.parametrize("name, support, condition", CASES, ids=[case[0] for case in CASES])
def test_all_seventeen_matrices_agree_with_the_reference(name, support, condition):
    cloud = gradpsi.read_cloud(REFERENCE / f"{name}.csv")
    near = gradpsi.find_neighbours(cloud, support)
    entries = {}
    with open(REFERENCE / f"{name}.triplets.csv") as file:
        for row in csv.DictReader(file):
            key = row["scheme"], int(row["axis"])
            entries.setdefault(key, []).append(
                (int(row["row"]), int(row["col"]), float(row["value"]))
            )
    compared = set()
    for scheme in gradpsi.schemes()[:17]:
        for axis, A in enumerate(gradpsi.assemble(scheme, cloud, near).axes):
            row, column, value = map(np.array, zip(*entries[scheme.name, axis]))
            expected = scipy.sparse.csr_matrix((value, (row, column)), A.shape)
            largest = np.abs(expected).max(axis=1).toarray()[:, 0]
            tolerance = 1e-13 * (1 if scheme.consistency == "zoc" else condition) * largest
            excess = np.abs(A - expected) - scipy.sparse.diags(tolerance) @ (abs(expected) > 0)
            assert excess.max() <= 0, scheme.name
            assert A.nnz == len(value), "entries that the reference lacks"
            compared.add((scheme.name, axis))
    assert compared == set(entries)


@pytest.mark.parametrize("scheme", ["laplacian-mixed-soc", "gradient-direct-soc"])
def test_the_program_writes_the_same_matrix(scheme, program, tmp_path):
    cloud = square()
    points = tmp_path / "points.csv"
    gradpsi.write_csv(
        points,
        {"x": cloud.positions[:, 0], "y": cloud.positions[:, 1], "volume": cloud.volumes},
    )
    subprocess.run(
        [program, "assemble", points, "--scheme", scheme, "--support-ratio", "3"]
        + ["-o", tmp_path / "out.mtx"],
        check=True,
        capture_output=True,
    )
    op = operator(scheme, cloud)
    ends = [""] if len(op.axes) == 1 else ["_x", "_y"]
    for A, end in zip(op.axes, ends):
        assert same(A, gradpsi.read_matrix_market(tmp_path / f"out{end}.mtx"))
        read_by_scipy = scipy.io.mmread(tmp_path / f"out{end}.mtx").tocsr()
        assert (A != read_by_scipy).nnz == 0


def test_second_order_is_exact_on_quadratics():
    cloud = square()
    x, y = cloud.positions.T
    u = 3 * x**2 - x * y + 2 * y
    gradient, laplacian = gradpsi.assemble(
        ["gradient-direct-soc", gradpsi.Scheme("laplacian-mixed-soc")],
        cloud,
        gradpsi.find_neighbours(cloud, 3 * cloud.spacing()),
    )
    # Rounding: eps cond / dx and eps cond / dx^2, cond below 1e5.
    assert np.allclose(gradient.axes[0] @ u, 6 * x - y, atol=1e-9)
    assert np.allclose(gradient.axes[1] @ u, 2 - x, atol=1e-9)
    assert np.allclose(laplacian.matrix @ u, 6, atol=1e-7)


def test_scipy_and_the_library_see_the_same_memory():
    cloud = square()
    op = operator("laplacian-mixed-soc", cloud)
    u = np.random.default_rng(1).random(len(cloud))
    first, second = op.matrix, op.axes[0]
    assert isinstance(first, scipy.sparse.csr_matrix)
    for part in ["data", "indices", "indptr"]:
        assert address(getattr(first, part)) == address(getattr(second, part))
        assert owner(getattr(first, part)) is op
    assert np.allclose(gradpsi.multiply(op, u), first @ u, rtol=1e-13)
    # Written by scipy, read by the library:
    first.data *= 2
    assert np.allclose(gradpsi.multiply(op, u), first @ u, rtol=1e-13)
    assert np.array_equal(second.data, first.data)
    # Written by the library, read by scipy:
    gradpsi.reassemble(
        "laplacian-mixed-soc", cloud, gradpsi.find_neighbours(cloud, 3 * cloud.spacing()), op
    )
    assert same(first, operator("laplacian-mixed-soc", cloud).matrix)


def test_points_that_move_within_their_skin_keep_their_lists():
    cloud = square(12)
    h, skin = 3 * cloud.spacing(), 0.5 * cloud.spacing()
    near = gradpsi.find_neighbours(cloud, h, skin=skin)
    assert near.skin == skin and gradpsi.find_neighbours(cloud, h).skin == 0
    op = gradpsi.assemble("laplacian-mixed-soc", cloud, near)
    step = np.random.default_rng(3).uniform(-0.35, 0.35, cloud.positions.shape) * skin
    moved = gradpsi.Cloud(cloud.positions + step, cloud.volumes)
    assert not gradpsi.is_stale(near, moved)
    gradpsi.reassemble("laplacian-mixed-soc", moved, near, op)
    own = gradpsi.assemble("laplacian-mixed-soc", moved, gradpsi.find_neighbours(moved, h)).matrix
    assert op.matrix.nnz > own.nnz and abs(op.matrix - own).max() < 1e-11 * abs(own).max()

    far = cloud.positions.copy()
    far[7] += 0.6 * skin
    gone = gradpsi.Cloud(far, cloud.volumes)
    assert gradpsi.is_stale(near, gone)
    with pytest.raises(gradpsi.InvalidInput, match="point 7 has moved by"):
        gradpsi.reassemble("laplacian-mixed-soc", gone, near, op)
    with pytest.raises(gradpsi.InvalidInput, match="without a skin"):
        gradpsi.is_stale(gradpsi.find_neighbours(cloud, h), cloud)
    with pytest.raises(gradpsi.InvalidInput, match="the skin must be > 0"):
        gradpsi.find_neighbours(cloud, h, skin=0)


def test_matrices_outlive_their_operator():
    op = operator("gradient-direct-foc", square())
    axes = op.axes
    copies = [A.copy() for A in axes]
    rows = op.rows
    outcome, degree = rows.outcome, rows.degree
    volumes = op.volumes
    del op, rows
    gc.collect()
    others = [np.full(n, 7.0) for n in range(1000, 3000)]  # takes what was set free
    assert all(same(A, copy) for A, copy in zip(axes, copies))
    assert set(outcome) == {0} and set(degree) == {1} and np.allclose(volumes, 1 / 144)
    assert len(others) == 2000


def test_operators_are_freed_with_the_last_array():
    """By the count of its references, the operator's own and those of three arrays."""
    import sys

    op = operator("laplacian-mixed-zoc", square())
    before = sys.getrefcount(op)
    A = op.matrix
    assert sys.getrefcount(op) == before + 3
    del A
    gc.collect()
    assert sys.getrefcount(op) == before


def test_the_pattern_is_protected_and_a_copy_is_free():
    A = operator("laplacian-mixed-zoc", square()).matrix
    for part in [A.indices, A.indptr]:
        with pytest.raises(ValueError, match="read-only"):
            part[0] = 10**9
    with pytest.raises(ValueError):
        A.eliminate_zeros()
    A.data[:] = 0
    B = A.copy()
    B.eliminate_zeros()
    assert B.nnz == 0


def test_what_scipy_does_every_day_works_on_what_is_shared():
    """Read-only index arrays stand in nobody's way."""
    cloud = square()
    A = operator("laplacian-mixed-zoc", cloud).matrix
    n = len(cloud)
    eye = scipy.sparse.identity(n, format="csr")
    b = np.ones(n)
    x = scipy.sparse.linalg.spsolve(eye - 1e-3 * A, b)
    assert np.allclose(x, 1)
    assert np.allclose(scipy.sparse.linalg.cg(eye - 1e-3 * (A + A.T) / 2, b, atol=0)[0], 1, atol=1e-4)
    # -A with its edge pulled down is regular, and is handed to the solvers as it is.
    A.setdiag(A.diagonal() - 1)
    assert np.allclose(scipy.sparse.linalg.spsolve(A, -b), 1)
    assert np.allclose(scipy.sparse.linalg.splu(A.tocsc()).solve(-b), 1)
    assert np.allclose(scipy.sparse.linalg.spilu(A.tocsc(), drop_tol=0).solve(-b), 1)
    assert scipy.sparse.linalg.eigs(A, k=1, which="LR", return_eigenvectors=False)[0].real < 0
    assert scipy.sparse.csgraph.connected_components(A)[0] == 1
    assert len(scipy.sparse.csgraph.reverse_cuthill_mckee(A)) == n
    assert A[3].shape == (1, n) and A[:, [1, 2]].shape == (n, 2) and A[edge_rows(n)].shape[1] == n
    assert (A.T @ A).nnz and scipy.sparse.vstack([A, A]).shape == (2 * n, n)
    assert A.has_sorted_indices and A.has_canonical_format
    A.sort_indices()
    A.sum_duplicates()
    A[2, 2] = 5  # an entry that is there
    assert A[2, 2] == 5
    A.check_format(full_check=True)


def owner(array):
    """What keeps the memory of a view alive."""
    while isinstance(array, np.ndarray):
        array = array.base
    return array


def edge_rows(n):
    return np.arange(0, n, 12)


def test_new_values_go_where_the_old_were():
    cloud, moved = square(), square()
    near = gradpsi.find_neighbours(cloud, 3 * cloud.spacing())
    moved = gradpsi.Cloud(cloud.positions + [0.5, 2.0], cloud.volumes * 2)
    op = gradpsi.assemble("laplacian-mixed-soc", cloud, near)
    A, volumes, rcond = op.matrix, op.volumes, op.rows.reciprocal_condition
    where = [address(x) for x in (A.data, volumes, rcond)]
    gradpsi.reassemble("laplacian-mixed-zoc", moved, near, op)
    expected = gradpsi.assemble("laplacian-mixed-zoc", moved, near)
    assert same(A, expected.matrix)
    assert np.array_equal(volumes, 2 * cloud.volumes)
    assert set(rcond) == {1}
    assert where == [address(x) for x in (op.matrix.data, op.volumes, op.rows.reciprocal_condition)]


def test_number_density_volumes_go_where_the_old_were():
    X = square().positions
    cloud = gradpsi.Cloud(X)
    near = gradpsi.find_neighbours(cloud, 0.25)
    op = gradpsi.assemble("laplacian-mixed-zoc", cloud, near)
    volumes = op.volumes
    gradpsi.reassemble("laplacian-mixed-zoc", gradpsi.Cloud(2 * X), near_of(2 * X, 0.5), op)
    assert address(volumes) == address(op.volumes)
    assert np.allclose(volumes, gradpsi.number_density_volumes(gradpsi.Cloud(2 * X), near_of(2 * X, 0.5)))


def near_of(X, support):
    return gradpsi.find_neighbours(gradpsi.Cloud(X), support)


def test_reassembly_refuses_another_pattern():
    cloud = square()
    near = gradpsi.find_neighbours(cloud, 3 * cloud.spacing())
    op = gradpsi.assemble("laplacian-mixed-zoc", cloud, near)
    before = op.matrix.copy()
    wider = gradpsi.find_neighbours(cloud, 4 * cloud.spacing())
    for arguments in [
        ("laplacian-mixed-zoc", cloud, wider, op),
        ("gradient-direct-zoc", cloud, near, op),
        ("laplacian-positive", cloud, near, op),
    ]:
        with pytest.raises(gradpsi.InvalidInput):
            gradpsi.reassemble(*arguments)
    with pytest.raises(gradpsi.InvalidInput, match="rows"):
        gradpsi.reassemble("laplacian-mixed-zoc", cloud, near, op, rows=[1, 2])
    assert same(op.matrix, before)


@pytest.mark.parametrize("how", [list, tuple, np.array, lambda r: np.array(r, np.uint8)])
def test_chosen_rows_are_rows_of_the_whole(how):
    cloud = square()
    whole = operator("laplacian-diffuse-soc", cloud)
    rows = [17, 3, 140]
    part = operator("laplacian-diffuse-soc", cloud, rows=how(rows))
    assert same(part.matrix, whole.matrix[rows])
    assert np.array_equal(part.rows.neighbours, whole.rows.neighbours[rows])
    mask = np.zeros(len(cloud), bool)
    mask[rows] = True
    assert same(operator("laplacian-diffuse-soc", cloud, rows=mask).matrix, whole.matrix[mask])
    assert operator("laplacian-diffuse-soc", cloud, rows=[]).matrix.shape == (0, 144)


def test_surfaces_have_derivatives_within_them():
    i = np.arange(2000)
    z, phi = 1 - (2 * i + 1) / 2000, i * np.pi * (3 - np.sqrt(5))
    x = np.c_[np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z]
    cloud = gradpsi.Cloud(x)
    near = gradpsi.find_neighbours(cloud, 0.25)
    laplacian, gradient = gradpsi.assemble(["laplacian-ls-3", "gradient-ls-3"], cloud, near, on_surface=True)
    assert np.abs(laplacian.matrix @ z + 2 * z).max() < 0.02
    assert np.abs((laplacian.normals * x).sum(1) ** 2 - 1).max() < 1e-4
    assert np.abs(gradient.axes[2] @ z - (1 - z * z)).max() < 1e-3
    with pytest.raises(gradpsi.StencilError):
        gradpsi.assemble("laplacian-ls-3", cloud, near)


@pytest.mark.parametrize(
    "rows, words",
    [
        ([144], "rows has point 144, there are 144"),
        ([-1], "rows has point -1"),
        ([2**40], "rows has point 1099511627776"),
        (np.array([2**64 - 1], np.uint64), "rows has point"),
        ([0.5], "rows must be indices or a mask, not of type float64"),
        ([True, False], "rows is a mask of 2 points, there are 144"),
        ([[1]], r"rows must be indices or a mask, not of shape \(1, 1\)"),
    ],
)
def test_rows_out_of_range_are_refused(rows, words):
    with pytest.raises(gradpsi.InvalidInput, match=words):
        operator("laplacian-mixed-zoc", square(), rows=rows)


def test_rows_are_reported():
    x = np.append(np.linspace(0, 1, 11), 5.0)
    cloud = gradpsi.Cloud(x, volumes=np.full(12, 0.1))
    near = gradpsi.find_neighbours(cloud, 0.25)
    op = gradpsi.assemble("gradient-direct-soc", cloud, near, on_degenerate="zero")
    rows = op.rows
    assert rows.degenerate == 1
    assert rows.outcome[-1] == gradpsi.RowOutcome.ZERO
    assert np.array_equal(rows.outcome == gradpsi.RowOutcome.AS_ASKED, np.arange(12) < 11)
    assert rows.degree.tolist() == [2] * 11 + [-1]
    assert rows.neighbours.tolist() == np.diff(near.offsets).tolist()
    assert set(rows.supports) == {0.25}
    assert rows.reciprocal_condition[-1] == 0 and np.all(rows.reciprocal_condition[:-1] > 1e-14)
    assert op.matrix[-1].nnz == 1 and op.matrix[-1, 11] == 0
    with pytest.raises(ValueError, match="read-only"):
        rows.outcome[0] = 9
    lowered = gradpsi.assemble("gradient-direct-soc", cloud, near, on_degenerate="lower").rows
    assert lowered.outcome[-1] == gradpsi.RowOutcome.ZERO
    assert [outcome.name for outcome in gradpsi.RowOutcome] == ["AS_ASKED", "LOWERED", "WIDENED", "ZERO"]


def test_rows_that_cannot_be_solved_are_named():
    x = np.append(np.linspace(0, 1, 11), 5.0)
    cloud = gradpsi.Cloud(x)
    near = gradpsi.find_neighbours(cloud, 0.25)
    with pytest.raises(gradpsi.StencilError, match="point 11.*no neighbour") as caught:
        gradpsi.assemble("gradient-direct-soc", cloud, near)
    error = caught.value
    assert (error.point, error.neighbours, error.reciprocal_condition) == (11, 0, 0.0)
    assert isinstance(error, RuntimeError)


@pytest.mark.parametrize(
    "options, words",
    [
        (dict(kernel="wendland"), "unknown kernel 'wendland'; valid: wendland-c2"),
        (dict(on_degenerate="fial"), "unknown on_degenerate 'fial'; valid: fail"),
        (dict(threads=-1), "threads"),
    ],
)
def test_bad_options_are_refused(options, words):
    with pytest.raises(gradpsi.InvalidInput, match=words):
        operator("laplacian-mixed-soc", square(), **options)


def test_bad_schemes_are_refused():
    cloud = square()
    near = gradpsi.find_neighbours(cloud, 0.25)
    with pytest.raises(gradpsi.InvalidInput, match="valid: laplacian-mixed-soc"):
        gradpsi.assemble(["laplacian-mixed-zoc", "laplacian-mixed-so"], cloud, near)
    with pytest.raises(TypeError, match="a scheme is a Scheme or its name, not 3"):
        gradpsi.assemble(3, cloud, near)
    assert gradpsi.assemble([], cloud, near) == []
    with pytest.raises(gradpsi.InvalidInput, match="144 points"):
        gradpsi.assemble("laplacian-mixed-zoc", square(5), near)


def test_kernels_and_threads_arrive():
    cloud = square()
    default = operator("laplacian-mixed-soc", cloud).matrix
    assert same(default, operator("laplacian-mixed-soc", cloud, kernel="wendland-c2", threads=1).matrix)
    assert same(default, operator("laplacian-mixed-soc", cloud, threads=3).matrix)
    assert not same(default, operator("laplacian-mixed-soc", cloud, kernel="quintic-spline").matrix)


def test_products_are_those_of_scipy():
    cloud = square()
    random = np.random.default_rng(1)
    u, U = random.random(len(cloud)), random.random((len(cloud), 5))
    laplacian, gradient = operator("laplacian-mixed-soc", cloud), operator("gradient-direct-soc", cloud)
    assert np.allclose(gradpsi.multiply(laplacian, u), laplacian.matrix @ u, rtol=1e-12)
    for layout in [U, np.asfortranarray(U), U.astype(np.float32)]:
        product = gradpsi.multiply(laplacian, layout)
        assert product.shape == (144, 5)
        assert np.allclose(product, laplacian.matrix @ layout.astype(float), rtol=1e-9)
    together = gradpsi.multiply(gradient, u, threads=2)
    assert np.allclose(together, np.column_stack([A @ u for A in gradient.axes]), rtol=1e-12)
    on_a_line = operator("gradient-direct-soc", gradpsi.lattice(9, dimension=1))
    assert gradpsi.multiply(on_a_line, np.ones(9)).shape == (9,)
    for wrong in [u[:-1], U[:-1], 1.0, None]:
        with pytest.raises(gradpsi.InvalidInput):
            gradpsi.multiply(laplacian, wrong)
    with pytest.raises(gradpsi.InvalidInput, match="one field at a time"):
        gradpsi.multiply(gradient, U)


def test_conductivities_scale_entries_by_their_mean():
    cloud = square()
    op = operator("laplacian-mixed-zoc", cloud)
    kappa = 1 + cloud.positions[:, 0]
    before = op.matrix.copy()
    for mean, of in [
        ("arithmetic", lambda a, b: (a + b) / 2),
        ("harmonic", lambda a, b: 2 * a * b / (a + b)),
    ]:
        A = gradpsi.with_conductivity(op, kappa, mean).matrix.tocoo()
        off = A.row != A.col
        expected = np.asarray(before[A.row[off], A.col[off]])[0] * of(kappa[A.row[off]], kappa[A.col[off]])
        assert np.allclose(A.data[off], expected, rtol=1e-14)
    assert same(op.matrix, before)
    with pytest.raises(gradpsi.InvalidInput, match="point 3"):
        gradpsi.with_conductivity(op, np.where(np.arange(144) == 3, -1, 1))
    with pytest.raises(gradpsi.InvalidInput, match="unknown mean"):
        gradpsi.with_conductivity(op, kappa, "geometric")


def test_symmetric_supports_make_a_zoc_operator_symmetric():
    rng = np.random.default_rng(2)
    x = rng.random((200, 2))
    cloud = gradpsi.Cloud(x)
    near = gradpsi.find_neighbours(cloud, rng.uniform(0.2, 0.3, 200))
    for scheme, sign in [("laplacian-mixed-zoc", 1), ("gradient-direct-zoc", -1)]:
        own = gradpsi.assemble(scheme, cloud, near)
        for A, B in zip(gradpsi.with_symmetric_supports(scheme, own).axes, own.axes):
            scaled = A.toarray() * own.volumes[:, None]
            before = B.toarray() * own.volumes[:, None]
            np.fill_diagonal(scaled, 0)
            np.fill_diagonal(before, 0)
            assert np.allclose(scaled, (before + sign * before.T) / 2, rtol=1e-13)
            assert np.allclose(A @ np.ones(200), 0, atol=1e-10)
    with pytest.raises(gradpsi.InvalidInput, match="is not symmetric"):
        gradpsi.with_symmetric_supports("laplacian-mixed-soc", own)


def test_values_between_the_points():
    cloud = square(12)
    h = 3.2 * cloud.spacing()
    probes = np.random.default_rng(5).uniform(0.1, 0.9, (20, 2))
    x, y = np.asarray(cloud.positions).T
    value, gradient = gradpsi.interpolate(["value-mls-2", "gradient-mls-2"], cloud, probes, h)
    assert value.matrix.shape == (20, 144)
    np.testing.assert_allclose(value.matrix @ (x * y), probes.prod(1), atol=1e-12)
    np.testing.assert_allclose(gradient.axes[0] @ (x * y), probes[:, 1], atol=1e-10)
    one = gradpsi.interpolate("value-mls-2", cloud, probes, np.full(144, h))
    assert (one.matrix != value.matrix).nnz == 0
    np.testing.assert_allclose(gradpsi.interpolate("value-mls-2", cloud, probes).matrix @ (x * y), probes.prod(1), atol=1e-12)
    weights = np.random.default_rng(6).random(20)
    R = gradpsi.conservative_transfer(value, weights)
    np.testing.assert_allclose(value.volumes @ (R @ np.ones(20)), weights.sum())
    with pytest.raises(gradpsi.InvalidInput, match="probe 0 at .* from point"):
        gradpsi.interpolate("value-mls-1", cloud, [[5.0, 5.0]], h)
    with pytest.raises(gradpsi.InvalidInput, match="volume of probe 3"):
        gradpsi.conservative_transfer(value, np.where(np.arange(20) == 3, np.nan, weights))
