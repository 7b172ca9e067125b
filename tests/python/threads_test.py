"""Long calls let other Python threads run, and threads may share what they made."""

import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import scipy.sparse

import gradpsi
from conftest import edge, operator, same, square


class Counter(threading.Thread):
    """Counts whenever it is let; gives way after each."""

    def __init__(self):
        super().__init__(daemon=True)
        self.count, self.stop = 0, False

    def run(self):
        while not self.stop:
            self.count += 1
            time.sleep(0)


def runs_beside(call, attempts):
    """Whether another thread comes to run while `call` does.

    Nobody is interrupted for the next hours, so that another thread runs only if `call` lets it. How fast
    it then gets there depends on the machine: `call` is repeated, with the same answer at last.
    """
    counter = Counter()
    interval = sys.getswitchinterval()
    counter.start()
    try:
        sys.setswitchinterval(1e4)
        start = counter.count
        while counter.count < start + 3:  # from then on it waits for as long
            time.sleep(0)
        for _ in range(attempts):
            before = counter.count
            call()
            if counter.count > before:
                return True
        return False
    finally:
        sys.setswitchinterval(interval)
        counter.stop = True
        counter.join()


def calls(tmp_path):
    cloud = square(60)
    near = gradpsi.find_neighbours(cloud, 3 * cloud.spacing())
    op = gradpsi.assemble("laplacian-mixed-zoc", cloud, near)
    heat = gradpsi.ImplicitDiffusion(cloud, op, time_step=1, fixed=edge(cloud))
    u = np.ones(len(cloud))
    x, y = cloud.positions.T
    points, matrix = tmp_path / "points.csv", tmp_path / "matrix.mtx"
    gradpsi.write_csv(points, {"x": x, "y": y})
    gradpsi.write_matrix_market(matrix, op.matrix)
    return {
        "spacing": lambda: gradpsi.read_cloud(points).spacing(),
        "search": lambda: gradpsi.find_neighbours(cloud, 0.1),
        "volumes": lambda: gradpsi.number_density_volumes(cloud, near),
        "assemble": lambda: gradpsi.assemble("laplacian-mixed-soc", cloud, near),
        "reassemble": lambda: gradpsi.reassemble("laplacian-mixed-zoc", cloud, near, op),
        "multiply": lambda: gradpsi.multiply(op, u),
        "factorise": lambda: heat.set_time_step(2),
        "step": lambda: heat.step(u),
        "diagnose": lambda: gradpsi.diagnose("laplacian-mixed-zoc", cloud, op),
        "read cloud": lambda: gradpsi.read_cloud(points),
        "read matrix": lambda: gradpsi.read_matrix_market(matrix),
    }


@pytest.mark.parametrize(
    "name",
    ["spacing", "search", "volumes", "assemble", "reassemble", "multiply", "factorise", "step"]
    + ["diagnose", "read cloud", "read matrix"],
)
def test_long_calls_let_others_run(name, tmp_path):
    assert runs_beside(calls(tmp_path)[name], 100_000)


def test_calls_that_do_not_are_seen():
    """That the test above can fail."""
    assert not runs_beside(lambda: sum(range(10_000)), 100)
    assert not runs_beside(lambda: gradpsi.schemes(), 100)


def test_threads_that_assemble_at_once_get_what_each_gets_alone():
    cloud = square(40)
    near = gradpsi.find_neighbours(cloud, 3 * cloud.spacing())
    names = [scheme.name for scheme in gradpsi.schemes()[:17]]

    def assemble(name):
        return gradpsi.assemble(name, cloud, near, on_degenerate="lower")

    alone = [assemble(name) for name in names]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(assemble, names))
    for a, b in zip(alone, together):
        assert all(same(A, B) for A, B in zip(a.axes, b.axes))


def test_threads_that_share_a_solver_take_turns():
    cloud = square(30)
    op = operator("laplacian-mixed-zoc", cloud)
    heat = gradpsi.ImplicitDiffusion(cloud, op, time_step=0.1, fixed=edge(cloud))
    solver = gradpsi.LinearSolver(scipy.sparse.identity(900) - op.matrix, cloud=cloud)
    fields = list(np.random.default_rng(1).random((64, 900)))
    for call in [heat.step, solver.solve]:
        alone = [call(u) for u in fields]
        with ThreadPoolExecutor(4) as pool:
            together = list(pool.map(call, fields))
        assert all(np.array_equal(a, b) for a, b in zip(alone, together))


def test_errors_cross_over_from_calls_that_let_others_run():
    line = gradpsi.Cloud(np.append(np.linspace(0, 1, 11), 5.0))
    near = gradpsi.find_neighbours(line, 0.25)

    def point(_):
        with pytest.raises(gradpsi.StencilError) as caught:
            gradpsi.assemble("gradient-direct-soc", line, near)
        return caught.value.point

    with ThreadPoolExecutor(4) as pool:
        assert set(pool.map(point, range(200))) == {11}
