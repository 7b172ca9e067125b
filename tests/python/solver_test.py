"""Linear systems and time steps from Python, against scipy's direct solver."""

import math

import numpy as np
import pytest
import scipy.sparse
import scipy.sparse.linalg

import gradpsi
from conftest import edge, operator, square


def literal_step(A, u, dt, theta, nu, source, fixed, fixed_values):
    """The theta method, written down for scipy.sparse.linalg.spsolve."""
    n = len(u)
    eye = scipy.sparse.identity(n, format="csr")
    left = (eye / dt - theta * nu * A).tolil()
    right = (eye / dt + (1 - theta) * nu * A) @ u + source
    for point, value in zip(fixed, fixed_values):
        left.rows[point], left.data[point] = [int(point)], [1.0]
        right[point] = value
    return scipy.sparse.linalg.spsolve(left.tocsr(), right)


@pytest.mark.parametrize("scheme", ["laplacian-mixed-zoc", "laplacian-mixed-soc-ls"])
@pytest.mark.parametrize("theta", [1.0, 0.5])
def test_steps_solve_the_literal_system(scheme, theta):
    cloud = square()
    op = operator(scheme, cloud)
    x, y = cloud.positions.T
    ends = np.flatnonzero(edge(cloud))
    u, values, source = np.sin(3 * x) * y, np.cos(y[ends]), 1 + x * y
    u[ends] = values
    heat = gradpsi.ImplicitDiffusion(
        cloud,
        op,
        time_step=0.01,
        diffusivity=0.7,
        theta=theta,
        source=source,
        fixed=ends,
        fixed_values=values,
    )
    assert heat.latest is None
    expected = literal_step(op.matrix, u, 0.01, theta, 0.7, source, ends, values)
    before = u.copy()
    result = heat.step(u)
    assert np.array_equal(u, before)
    # Both residuals are below 1e-12, the condition number is below 100.
    assert np.allclose(result, expected, rtol=0, atol=1e-10)
    assert 0 <= heat.latest.residual <= 1e-12 and heat.latest.seconds >= 0
    assert heat.latest.iterations >= 0
    if theta == 0.5:
        half = u
        for _ in range(2):
            half = literal_step(op.matrix, half, 0.005, 1, 0.7, source, ends, values)
        assert np.allclose(heat.damped_step(u), half, rtol=0, atol=1e-10)
    else:
        with pytest.raises(gradpsi.InvalidInput, match="theta must be 0.5, not 1"):
            heat.damped_step(u)
    method = "cholesky" if scheme.endswith("-zoc") else "lu"
    assert heat.solver.method in (method, "krylov") and heat.solver.unknowns == 144 - len(ends)
    assert heat.solver.reason and heat.solver.description


def test_a_mask_of_points_does_as_well_as_their_indices():
    cloud = square()
    op = operator("laplacian-mixed-zoc", cloud)
    u = cloud.positions[:, 0]
    mask = edge(cloud)
    results = [
        gradpsi.ImplicitDiffusion(cloud, op, time_step=0.1, fixed=fixed).step(u)
        for fixed in [mask, np.flatnonzero(mask), np.flatnonzero(mask).tolist()]
    ]
    assert np.array_equal(results[0], results[1]) and np.array_equal(results[0], results[2])
    assert np.array_equal(results[0][mask], u[mask])


def test_several_fields_step_as_each_alone():
    cloud = square()
    heat = gradpsi.ImplicitDiffusion(
        cloud, operator("laplacian-mixed-zoc", cloud), time_step=0.1, fixed=edge(cloud)
    )
    U = np.random.default_rng(1).random((144, 3))
    together = heat.step(U)
    assert together.shape == (144, 3)
    for k in range(3):
        alone = heat.step(U[:, k])
        assert alone.shape == (144,)
        assert np.allclose(together[:, k], alone, rtol=1e-12)
    assert np.array_equal(heat.step(np.asfortranarray(U)), together)
    assert np.array_equal(heat.step(U[:, 1]), heat.step(np.repeat(U[:, 1], 2)[::2]))


def test_the_steady_field_between_held_ends_is_linear():
    cloud = gradpsi.lattice(20, dimension=1)
    x = cloud.positions[:, 0]
    ends = [0, 19]
    op = operator("laplacian-mixed-zoc", cloud, 1.5)
    heat = gradpsi.ImplicitDiffusion(
        cloud, op, time_step=math.inf, fixed=ends, fixed_values=x[ends]
    )
    assert np.allclose(heat.step(np.zeros(20)), x, atol=1e-11)


def test_walls_give_the_slope_that_they_are_given():
    """u = x: its value is held left, its slope 1 right."""
    cloud = gradpsi.lattice(20, dimension=1)
    near = gradpsi.find_neighbours(cloud, 3.5 * cloud.spacing())
    laplacian = gradpsi.assemble("laplacian-mixed-soc", cloud, near)
    gradient = gradpsi.assemble("gradient-direct-soc", cloud, near, rows=[19])
    x = cloud.positions[:, 0]
    walls = gradpsi.WallConditions([19], [[2.0]], gradient, flux=[2.0])
    heat = gradpsi.ImplicitDiffusion(
        cloud, laplacian, time_step=math.inf, fixed=[0], fixed_values=x[:1], walls=walls
    )
    assert np.allclose(heat.step(np.zeros(20)), x, atol=1e-10)
    # u + n . grad u = flux, with flux as it is for u = x.
    walls = gradpsi.WallConditions([19], [1.0], gradient, flux=[x[19] + 1], transfer=[1.0])
    heat = gradpsi.ImplicitDiffusion(
        cloud, laplacian, time_step=math.inf, fixed=[0], fixed_values=x[:1], walls=walls
    )
    assert np.allclose(heat.step(np.zeros(20)), x, atol=1e-10)
    with pytest.raises(gradpsi.InvalidInput, match="flux has 2 entries, expected 1"):
        gradpsi.WallConditions([19], [1.0], gradient, flux=[1, 2])
    with pytest.raises(gradpsi.InvalidInput, match="points has point 20, there are 20"):
        gradpsi.WallConditions([20], [1.0], gradient)
    with pytest.raises(gradpsi.InvalidInput):
        gradpsi.ImplicitDiffusion(cloud, laplacian, time_step=1, fixed=[19], walls=walls)


def test_the_time_step_can_be_changed():
    cloud = square()
    op = operator("laplacian-mixed-zoc", cloud)
    u = cloud.positions[:, 0] ** 2
    heat = gradpsi.ImplicitDiffusion(cloud, op, time_step=0.1, fixed=[0])
    first = heat.step(u)
    heat.set_time_step(0.01)
    fresh = gradpsi.ImplicitDiffusion(cloud, op, time_step=0.01, fixed=[0])
    assert np.allclose(heat.step(u), fresh.step(u), rtol=1e-12)
    assert not np.allclose(heat.step(u), first)
    with pytest.raises(gradpsi.InvalidInput):
        heat.set_time_step(-1)


def test_solvers_keep_what_they_need():
    cloud = square()
    op = operator("laplacian-mixed-zoc", cloud)
    u = np.ones(144)
    heat = gradpsi.ImplicitDiffusion(cloud, op, time_step=0.1)
    A = op.matrix
    solver = gradpsi.LinearSolver(scipy.sparse.identity(144) - A, cloud=cloud)
    A.data[:] = np.nan  # the solvers have copies
    del cloud, op, A
    assert np.allclose(heat.step(u), 1, atol=1e-11)
    assert np.allclose(solver.solve(u), 1, atol=1e-11)


@pytest.mark.parametrize(
    "options, words",
    [
        (dict(time_step=-1), "time_step|time step"),
        (dict(time_step=math.nan), "time_step|time step"),
        (dict(time_step=1, theta=0.2), "theta"),
        (dict(time_step=1, diffusivity=-1), "diffusivity"),
        (dict(time_step=1, source=[1, 2]), "source has 2 entries, expected 144"),
        (dict(time_step=1, fixed=[144]), "fixed has point 144, there are 144"),
        (dict(time_step=1, fixed=[3, 3]), "point 3"),
        (dict(time_step=1, fixed=[3], fixed_values=[1, 2]), "fixed_values has 2 entries, expected 1"),
        (dict(time_step=1, fixed=[3], fixed_values=[math.nan]), "entry 0 of fixed.values is not finite"),
    ],
)
def test_bad_problems_are_refused(options, words):
    cloud = square()
    with pytest.raises(gradpsi.InvalidInput, match=words):
        gradpsi.ImplicitDiffusion(cloud, operator("laplacian-mixed-zoc", cloud), **options)


def test_a_steady_problem_without_conditions_is_singular():
    cloud = square()
    with pytest.raises(gradpsi.SolverError) as caught:
        gradpsi.ImplicitDiffusion(cloud, operator("laplacian-mixed-zoc", cloud), time_step=math.inf)
    assert math.isnan(caught.value.residual) and isinstance(caught.value, RuntimeError)


def test_fields_that_are_not_finite_are_refused():
    cloud = square()
    heat = gradpsi.ImplicitDiffusion(cloud, operator("laplacian-mixed-zoc", cloud), time_step=1)
    u = np.ones(144)
    u[7] = np.nan
    with pytest.raises(gradpsi.InvalidInput, match="point 7"):
        heat.step(u)
    for wrong in [np.ones(143), np.ones((2, 144, 1)), 1.0, None, ["a"] * 144]:
        with pytest.raises(gradpsi.InvalidInput):
            heat.step(wrong)


@pytest.mark.parametrize("method", ["auto", "cholesky", "lu", "krylov"])
def test_every_method_solves(method):
    cloud = square()
    A = scipy.sparse.identity(144) - 0.01 * operator("laplacian-mixed-zoc", cloud).matrix
    options = gradpsi.SolverOptions(method=method, tolerance=1e-11)
    assert (options.method, options.tolerance, options.ordering) == (method, 1e-11, "coordinates")
    solver = gradpsi.LinearSolver(A, options, cloud)
    assert solver.report.method == (method if method != "auto" else "cholesky")
    B = np.random.default_rng(1).random((144, 2))
    X = solver.solve(B)
    assert np.linalg.norm(A @ X - B) <= 1.5e-11 * np.linalg.norm(B)
    assert solver.latest.residual <= 1e-11
    if method == "krylov":
        assert solver.latest.iterations > 0
        solver.solve(B, guess=X)
        assert solver.latest.iterations == 0
    else:
        assert solver.report.factor.entries >= 144 and solver.report.factor.description
    x = solver.solve(B[:, 0])
    assert x.shape == (144,) and np.allclose(x, X[:, 0], atol=1e-9)


@pytest.mark.parametrize("form", ["csr", "csc", "coo", "lil", "dense", "single", "int", "long indices"])
def test_matrices_of_any_form_are_taken(form):
    A = scipy.sparse.csr_matrix([[4, 1, 0], [1, 5, 0], [0, 2, 3]], dtype=float)
    B = {
        "dense": lambda: A.toarray(),
        "single": lambda: A.astype(np.float32),
        "int": lambda: A.astype(int),
        "long indices": lambda: long_indices(A),
    }.get(form, lambda: A.asformat(form))()
    assert np.allclose(gradpsi.LinearSolver(B).solve([5, 6, 5]), 1)


def long_indices(A):
    B = A.copy()
    B.indices, B.indptr = B.indices.astype(np.int64), B.indptr.astype(np.int64)
    return B


def test_unsorted_and_repeated_entries_are_summed():
    A = scipy.sparse.csr_matrix(
        (np.array([1.0, 1, 2, 1, 4, 1]), np.array([1, 0, 0, 0, 1, 0]), np.array([0, 4, 6])), (2, 2)
    )
    copy = A.copy()
    assert np.allclose(gradpsi.LinearSolver(A).solve(A.toarray() @ [1, 2]), [1, 2])
    assert np.array_equal(A.indices, copy.indices) and np.array_equal(A.data, copy.data)


def test_bad_matrices_are_refused():
    eye = scipy.sparse.identity(3, format="csr")
    with pytest.raises(gradpsi.InvalidInput, match="square"):
        gradpsi.LinearSolver(eye[:2])
    with pytest.raises(gradpsi.InvalidInput, match="matrix must be real numbers"):
        gradpsi.LinearSolver(1j * eye)
    with pytest.raises(gradpsi.InvalidInput):
        gradpsi.LinearSolver(eye * np.nan)
    with pytest.raises(gradpsi.SolverError):
        gradpsi.LinearSolver(np.ones((2, 2)))
    with pytest.raises(gradpsi.InvalidInput, match="symmetric"):
        gradpsi.LinearSolver([[1, 1], [0, 1]], gradpsi.SolverOptions(method="cholesky"))
    broken = eye.copy()
    broken.indices[1] = 10**6  # would be read far outside
    with pytest.raises(ValueError):
        gradpsi.LinearSolver(broken)
    with pytest.raises(gradpsi.InvalidInput, match="unknown method 'ul'; valid: lu"):
        gradpsi.SolverOptions(method="ul")
    with pytest.raises(gradpsi.InvalidInput, match="unknown ordering"):
        gradpsi.SolverOptions(ordering="random")
    with pytest.raises(TypeError):
        gradpsi.SolverOptions("lu")
    with pytest.raises(gradpsi.InvalidInput):
        gradpsi.LinearSolver(eye, gradpsi.SolverOptions(tolerance=-1))


def test_refactored_solvers_solve_the_new_system():
    A = scipy.sparse.csr_matrix([[4.0, 1], [1, 3]])
    solver = gradpsi.LinearSolver(A)
    assert solver.latest is None
    solver.refactor(2 * A)
    assert np.allclose(solver.solve(A @ [1, 2]), [0.5, 1])
    with pytest.raises(gradpsi.InvalidInput):
        solver.refactor(scipy.sparse.identity(2))
    assert np.allclose(solver.solve(A @ [1, 2]), [0.5, 1])
    for b, guess in [([1, 2, 3], None), ([1, np.nan], None), ([1, 2], [1]), ([1, 2], [1, np.inf])]:
        with pytest.raises(gradpsi.InvalidInput):
            solver.solve(b, guess)


@pytest.mark.parametrize("transfer", [0, 3])
def test_walls_with_a_flux_or_exchange_are_of_second_order(transfer):
    """x^2 - y^2 on the unit square: three sides are held, x = 1 is a wall; exact, being of degree 2."""
    side = np.linspace(0, 1, 15)
    x, y = (a.ravel() for a in np.meshgrid(side, side))
    inner = (x > 0) & (x < 1) & (y > 0) & (y < 1)
    random = np.random.default_rng(4)
    x, y = x + inner * random.uniform(-0.01, 0.01, x.size), y + inner * random.uniform(-0.01, 0.01, x.size)
    cloud = gradpsi.Cloud(np.column_stack([x, y]))
    near = gradpsi.find_neighbours(cloud, 0.2)
    laplacian = gradpsi.assemble("laplacian-ls-2", cloud, near)
    walls = np.flatnonzero((x == 1) & (y > 0) & (y < 1))
    flux = 4 + transfer * (1 - y[walls] ** 2)
    laplacian, source, remaining = gradpsi.with_walls(laplacian, cloud, near, walls, [[2, 0]] * walls.size, flux,
                                                      transfer * np.ones(walls.size))
    assert remaining.size == 0
    held = np.flatnonzero((x == 0) | (y == 0) | (y == 1))
    exact = x**2 - y**2
    heat = gradpsi.ImplicitDiffusion(cloud, laplacian, time_step=np.inf, source=source, fixed=held)
    u = heat.step(np.where(np.isin(np.arange(x.size), held), exact, 0.0))
    assert np.allclose(u, exact, atol=1e-9)
    with pytest.raises(gradpsi.InvalidInput, match="is zero or not finite"):
        gradpsi.with_walls(laplacian, cloud, near, walls, np.zeros((walls.size, 2)))


def test_a_mean_says_which_of_many_solutions_is_wanted():
    A = scipy.sparse.csr_matrix([[1.0, -1.0], [-1.0, 1.0]])
    with pytest.raises(gradpsi.SolverError, match="singular"):
        gradpsi.LinearSolver(A)
    options = gradpsi.SolverOptions(mean=2, solves=1)
    assert options.mean == 2 and options.solves == 1 and gradpsi.SolverOptions().mean is None
    solver = gradpsi.LinearSolver(A, options)
    assert np.allclose(solver.solve([1, 0]), [2.25, 1.75])
    assert solver.latest.removed == pytest.approx(0.5)
    with pytest.raises(gradpsi.InvalidInput, match="solves"):
        gradpsi.LinearSolver(A, gradpsi.SolverOptions(solves=-1))
    cloud = square()
    heat = gradpsi.ImplicitDiffusion(
        cloud, operator("laplacian-mixed-zoc", cloud), time_step=1, solver=gradpsi.SolverOptions(method="multigrid")
    )
    heat.step(np.ones(144))
    assert heat.solver.method == "multigrid" and "levels of points" in heat.solver.description


def test_poisson_problems_follow_their_points():
    cloud = square()
    psi = operator("laplacian-mixed-soc", cloud)
    u = np.random.default_rng(3).random(144)
    fixed = np.arange(12)
    poisson = gradpsi.Poisson(cloud, psi, fixed=fixed, fixed_values=u[fixed])
    assert np.allclose(poisson.solve(psi.matrix @ u), u, atol=1e-8)
    other = operator("laplacian-mixed-zoc", cloud)
    poisson.update(cloud, other, fixed=fixed)
    start = np.where(np.isin(np.arange(144), fixed), u, 0)
    assert np.allclose(poisson.solve(other.matrix @ u, guess=start), u, atol=1e-8)
    assert poisson.solver.unknowns == 132 and poisson.latest.residual < 1e-9
    free = gradpsi.Poisson(cloud, other)
    free.solve(np.ones(144))
    assert free.latest.removed == pytest.approx(1)
    for wrong in (np.ones(143), np.ones((144, 2)), np.full(144, np.nan)):
        with pytest.raises(gradpsi.InvalidInput):
            free.solve(wrong)


def test_diffusion_is_updated_to_other_points():
    cloud = square()
    heat = gradpsi.ImplicitDiffusion(cloud, operator("laplacian-mixed-zoc", cloud), time_step=0.1)
    psi = operator("laplacian-mixed-soc", cloud)
    heat.update(cloud, psi, fixed=[5])
    u = np.random.default_rng(4).random(144)
    assert np.array_equal(heat.step(u), gradpsi.ImplicitDiffusion(cloud, psi, time_step=0.1, fixed=[5]).step(u))
