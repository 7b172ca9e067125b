"""The scripts of apps/python run, draw, and print what the README says that they do."""

import re
import subprocess
import sys

import pytest

from conftest import ROOT

FOLDER = ROOT / "apps" / "python"
SCRIPTS = sorted(script.name for script in FOLDER.glob("[0-9]_*.py"))


def run(script, *arguments):
    done = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning:__main__", FOLDER / script, *arguments],
        capture_output=True,
        text=True,
        cwd=ROOT,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_example_prints_what_is_known():
    """As apps/example.cpp and apps/heat_example.cpp do on the same points."""
    assert run("example.py") == "du/dx in [4.2, 4.9]\ncholesky, mean temperature 0.531\n"


def test_there_are_three_scripts_and_the_page_shows_each():
    assert len(SCRIPTS) == 3
    page = (FOLDER / "README.md").read_text()
    for script in SCRIPTS:
        picture = "figures/" + script.replace(".py", ".png")
        assert f"apps/python/{script}" in page and f"({picture})" in page
        assert (FOLDER / picture).stat().st_size < 150_000


@pytest.fixture(scope="module", params=SCRIPTS)
def drawn(request, tmp_path_factory):
    """A script's name, what it printed, and the folder that it was told to draw into."""
    pytest.importorskip("matplotlib")
    folder = tmp_path_factory.mktemp("pictures")
    return request.param, run(request.param, folder), folder


def test_scripts_draw_where_they_are_told(drawn):
    script, _, folder = drawn
    (picture,) = folder.iterdir()
    assert picture.name == script.replace(".py", ".png")
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_scripts_find_what_is_known(drawn):
    script, printed, _ = drawn
    {
        "1_differentiate.py": check_differentiation,
        "2_heat.py": check_heat,
        "3_choose_a_scheme.py": check_choice,
    }[script](printed)


def check_differentiation(printed):
    """Each correction makes the median error at least three times smaller."""
    medians = [float(e) for e in re.findall(r"error (\S+) \(median\)", printed)]
    assert len(medians) == 3
    assert medians[0] > 3 * medians[1] > 9 * medians[2]


def check_heat(printed):
    """The exact series."""
    errors = re.findall(r"t = (\S+) *: largest error (\S+)", printed)
    assert [t for t, _ in errors] == ["0.02", "0.1", "0.3", "inf"]
    assert max(float(e) for _, e in errors) < 0.02  # backward Euler, steps of 2e-3, from a jump
    assert float(errors[-1][1]) < 1e-8  # a straight line: exact


def check_choice(printed):
    """apps/README.md: least squares of second order with all edges held are stable, direct is not."""
    rows = re.findall(r"^(laplacian-\S+) +(\S+) +(\S+) +(\S+) +(yes|no)", printed, re.M)
    grows = {(name, ratio): answer == "yes" for name, ratio, _, _, answer in rows}
    assert grows["laplacian-direct-soc", "3.0"]
    assert not grows["laplacian-mixed-soc-ls", "3.0"] and not grows["laplacian-positive", "3.0"]
