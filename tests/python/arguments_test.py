"""What calls say that cannot be meant."""

import re

import numpy as np
import pytest
import scipy.sparse

import gradpsi
from conftest import operator, square


def hidden(array, at=1):
    """The array, one of its elements masked."""
    result = np.ma.masked_array(array)
    result[at] = np.ma.masked
    return result


def masked_calls():
    cloud = square(6)
    near = gradpsi.find_neighbours(cloud, 0.5)
    op = operator("laplacian-mixed-zoc", cloud)
    n, ones = len(cloud), np.ones(len(cloud))
    solver = gradpsi.LinearSolver(scipy.sparse.identity(n))
    return {
        "positions": lambda: gradpsi.Cloud(hidden(cloud.positions, (3, 1))),
        "positions of rows": lambda: gradpsi.Cloud([hidden(row) for row in cloud.positions]),
        "volumes": lambda: gradpsi.Cloud(cloud.positions, hidden(ones)),
        "box": lambda: gradpsi.Cloud(cloud.positions, box=hidden([2.0, 2.0])),
        "support": lambda: gradpsi.find_neighbours(cloud, hidden(ones)),
        "rows": lambda: gradpsi.assemble("laplacian-mixed-zoc", cloud, near, rows=hidden(np.arange(n))),
        "u": lambda: gradpsi.multiply(op, hidden(ones)),
        "matrix": lambda: gradpsi.LinearSolver(hidden(np.eye(n), (2, 2))),
        "b": lambda: solver.solve(hidden(ones)),
        "guess": lambda: solver.solve(ones, hidden(ones)),
        "fixed": lambda: gradpsi.ImplicitDiffusion(cloud, op, time_step=1, fixed=hidden(ones > 0)),
        "source": lambda: gradpsi.ImplicitDiffusion(cloud, op, time_step=1, source=hidden(ones)),
        "probes": lambda: gradpsi.interpolate("value-mls-1", cloud, hidden(cloud.positions, (0, 0))),
        "derivatives": lambda: gradpsi.error_bound(gradpsi.diagnose("laplacian-mixed-zoc", cloud, op), hidden(ones)),
    }


@pytest.mark.parametrize("name", masked_calls())
def test_40_masked_arrays_are_refused(name):
    with pytest.raises(gradpsi.InvalidInput, match=f"^{name.split()[0]} has masked elements: fill them"):
        masked_calls()[name]()


def test_arrays_that_could_be_masked_and_are_not_are_taken():
    x = np.ma.masked_array(square().positions, mask=False)
    assert len(gradpsi.Cloud(x)) == len(gradpsi.Cloud(list(x))) == 144


def required(line):
    """Names of the arguments without a default, from the line that pybind11 puts before a docstring."""
    inside = re.sub(r"<[^<>]*>", "", line[line.index("(") + 1 : line.rindex(") -> ")])
    return re.findall(r"(?:^|, )(\w+): [^=,]*(?=,|$)", inside)


def bound():
    """All functions, methods and constructors, and what they are called in messages."""
    for name in gradpsi.__all__:
        thing = getattr(gradpsi, name)
        if not isinstance(thing, type):
            yield name, thing
        elif "pybind" in type(thing).__name__:
            for member, value in vars(thing).items():
                if (value.__doc__ or "").startswith(f"{member}(self"):
                    yield name if member == "__init__" else member, value.__get__(None, thing)


@pytest.mark.parametrize("name, function", bound())
def test_40_a_missing_argument_is_named_in_one_sentence(name, function):
    wanted = required(function.__doc__.splitlines()[0])
    if function.__doc__.startswith("__init__("):
        function, wanted = getattr(gradpsi, name), wanted[1:]
    if not wanted:
        return
    with pytest.raises(TypeError) as caught:
        function()
    names = " and ".join([", ".join(wanted[:-1]), wanted[-1]]) if len(wanted) > 1 else wanted[0]
    assert str(caught.value) == f"{name}() is missing its argument{'s' * (len(wanted) > 1)} {names}"


def test_what_else_does_not_fit_is_one_sentence():
    cloud = square(6)
    near = gradpsi.find_neighbours(cloud, 0.5)
    op = operator("laplacian-mixed-zoc", cloud)
    for call, said in [
        (lambda: gradpsi.find_neighbours(cloud), "find_neighbours() is missing its argument support"),
        (lambda: gradpsi.find_neighbours(support=1), "find_neighbours() is missing its argument cloud"),
        (lambda: gradpsi.ImplicitDiffusion(cloud, op), "ImplicitDiffusion() is missing its argument time_step"),
        (lambda: gradpsi.LinearSolver([[1.0]]).solve(), "solve() is missing its argument b"),
        (lambda: gradpsi.assemble("laplacian-mixed-zoc", cloud, near, thread=1),
         "assemble() has no argument thread; valid: "
         "scheme, cloud, near, kernel, on_degenerate, rows, on_surface, threads"),
        (lambda: gradpsi.assemble("laplacian-mixed-zoc", cloud, near, "wendland-c2"),
         "assemble() takes 3 arguments without a name, not 4"),
        (lambda: gradpsi.assemble("laplacian-mixed-zoc", cloud, 0.5),
         "assemble() wants near to be of type gradpsi.Neighbours, not float"),
        (lambda: gradpsi.find_neighbours(cloud, 0.5, cloud=cloud), "find_neighbours() is given cloud twice"),
        (lambda: cloud.spacing("all"), "spacing() wants threads to be of type int, not str"),
        (lambda: cloud.spacing(2**40), "spacing() takes (threads: int = 0), which these arguments are not"),
    ]:
        with pytest.raises(TypeError) as caught:
            call()
        assert str(caught.value) == said


def test_errors_of_other_types_pass():
    with pytest.raises(TypeError, match="^a scheme is a Scheme or its name, not 3$"):
        gradpsi.assemble(3, square(6), gradpsi.find_neighbours(square(6), 0.5))
