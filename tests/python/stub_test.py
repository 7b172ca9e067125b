"""The type hints say what the module has: names, arguments and defaults; all is documented."""

import ast
import inspect
import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

import gradpsi

PACKAGE = Path(gradpsi.__file__).resolve().parent
STUB = ast.parse((PACKAGE / "__init__.pyi").read_text())


def signature(function):
    """Names, kinds and defaults of a def's arguments; "..." stands for a default without a literal."""
    a = function.args
    positional = a.posonlyargs + a.args
    defaults = [None] * (len(positional) - len(a.defaults)) + a.defaults
    result = [(arg.arg, "positional", d and ast.unparse(d)) for arg, d in zip(positional, defaults)]
    return result + [
        (arg.arg, "keyword", d and ast.unparse(d)) for arg, d in zip(a.kwonlyargs, a.kw_defaults)
    ]


def documented_signature(name, function):
    """The same, from the first line that pybind11 puts before a docstring."""
    line = function.__doc__.splitlines()[0]
    assert line.startswith(name + "("), line
    line = re.sub(r"<[^<>]*>", "...", line)  # the repr of an object
    return signature(ast.parse(f"def {line}: ...").body[0])


def stub_functions(body):
    functions = {}
    for node in body:
        if isinstance(node, ast.FunctionDef):
            functions.setdefault(node.name, []).append(node)
    return functions


def is_property(function):
    return any(getattr(d, "id", "") == "property" for d in function.decorator_list)


CLASSES = {node.name: node for node in STUB.body if isinstance(node, ast.ClassDef)}
FUNCTIONS = stub_functions(STUB.body)
BOUND = [
    name for name in CLASSES if not issubclass(getattr(gradpsi, name), (Exception, int))
]


def test_every_public_name_is_in_both():
    assert set(gradpsi.__all__) == set(CLASSES) | set(FUNCTIONS)
    assert (PACKAGE / "py.typed").exists()
    assert re.fullmatch(r"\d+\.\d+\.\d+", gradpsi.__version__)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_functions_have_the_arguments_of_their_hints(name):
    found = documented_signature(name, getattr(gradpsi, name))
    for overload in FUNCTIONS[name]:
        assert signature(overload) == found


@pytest.mark.parametrize("name", BOUND)
def test_classes_have_the_members_of_their_hints(name):
    cls, hints = getattr(gradpsi, name), stub_functions(CLASSES[name].body)
    special = {"__init__", "__len__", "__eq__", "__hash__"}
    has = {m for m in vars(cls) if not m.startswith("_") or m in special}
    if "__init__" in has and "__init__" not in hints:
        with pytest.raises(TypeError, match="No constructor defined"):
            cls()
        has.discard("__init__")
    if "__eq__" not in hints:
        has.discard("__hash__")
    assert has == set(hints)
    for member, (hint,) in hints.items():
        found = vars(cls)[member]
        assert is_property(hint) == isinstance(found, property), member
        if not is_property(hint):
            assert signature(hint) == documented_signature(member, found)


def test_enumerations_have_the_members_of_their_hints():
    hints = {
        node.targets[0].id: node.value.value
        for node in CLASSES["RowOutcome"].body
        if isinstance(node, ast.Assign)
    }
    assert hints == {outcome.name: outcome.value for outcome in gradpsi.RowOutcome}


def test_errors_are_what_python_calls_such_errors():
    for name, node in CLASSES.items():
        if isinstance(getattr(gradpsi, name), type) and issubclass(getattr(gradpsi, name), Exception):
            assert [base.id for base in node.bases] == [getattr(gradpsi, name).__base__.__name__]


def text(thing):
    """A docstring without the signature."""
    doc = inspect.getdoc(thing) or ""
    return re.sub(r"^\w+\(.*\n*", "", doc)


def test_everything_is_documented_and_says_where_it_lives():
    for name in gradpsi.__all__:
        thing = getattr(gradpsi, name)
        assert len(text(thing)) > 15, name
        assert thing.__module__ == "gradpsi"
        if name in BOUND:
            for member, value in vars(thing).items():
                if not member.startswith("_"):
                    assert text(value), f"{name}.{member}"
            if "__init__" in stub_functions(CLASSES[name].body):
                assert len(text(thing.__init__)) > 20, name
    assert gradpsi.__doc__


@pytest.mark.skipif(not find_spec("mypy"), reason="mypy is not installed")
def test_mypy_finds_the_hints_right(tmp_path):
    config, allowed = tmp_path / "mypy.ini", tmp_path / "allowed"
    config.write_text("[mypy]\nignore_missing_imports = true\n")  # scipy has no hints
    # pybind11's metaclass, and the constructor that classes without one have.
    allowed.write_text("gradpsi\\.[A-Z]\\w+\ngradpsi\\.[A-Z]\\w+\\.__init__\n")
    done = subprocess.run(
        [sys.executable, "-m", "mypy.stubtest", "gradpsi", "--ignore-missing-stub"]
        + ["--ignore-unused-allowlist", "--allowlist", allowed, "--mypy-config-file", config],
        capture_output=True,
        text=True,
        cwd=tmp_path,  # where its cache goes
        env={**os.environ, "PYTHONPATH": str(PACKAGE.parent)},
    )
    assert done.returncode == 0 and "Success" in done.stdout, done.stdout + done.stderr
