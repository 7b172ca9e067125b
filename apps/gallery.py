#!/usr/bin/env python3
"""A gallery of clouds: errors and verdicts of schemes on even, graded, flat, thin and curved points.

    python3 apps/gallery.py [PROGRAM [SCHEME ...]]    (needs numpy; a few minutes)

On each of twelve clouds a wave sin(k . x + 0.3), half as long as the cloud, is differentiated by `gradpsi derive`, and
`gradpsi inspect` judges the matrix of the Laplacian, the outermost points being held. Prints two tables, of gradients
and of Laplacians. A cell is the root mean square error over the largest exact value, of all rows that have an answer;
"- 12" says that 12 rows have none; "grows" that fields would grow in implicit steps.
"""

import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
# Neighbours in 2D and on surfaces, and in 3D.
SCHEMES = {"gradient-direct-zoc": (28, 90), "gradient-direct-foc": (28, 90), "gradient-direct-soc": (28, 90),
           "gradient-ls-1": (20, 40), "gradient-ls-2": (28, 90), "gradient-ls-4": (64, 260),
           "laplacian-mixed-zoc": (28, 90), "laplacian-mixed-soc": (28, 90), "laplacian-mixed-soc-ls": (28, 90),
           "laplacian-ls-2": (28, 90), "laplacian-ls-3": (38, 130), "laplacian-ls-4": (64, 260), "laplacian-positive": (20, 60)}
SQUARE = 50  # points a side


def grid(*sides):
    return np.array(np.meshgrid(*[np.arange(n) + 0.5 for n in sides], indexing="ij")).reshape(len(sides), -1).T


def rim(x, low, high, width):
    """Points near the sides of a box."""
    return ((x < low + width) | (x > high - width)).any(1)


def square(jitter, random):
    x = (grid(SQUARE, SQUARE) + random.uniform(-jitter, jitter, (SQUARE**2, 2))) / SQUARE
    return x, rim(x, 0, 1, 1 / SQUARE)


def anywhere(random):
    x = random.uniform(size=(SQUARE**2, 2))
    return x, rim(x, 0, 1, 1 / SQUARE)


def halton(_):
    def radical_inverse(i, base):
        result, digit = np.zeros(len(i)), 1.0 / base
        while i.any():
            result, i, digit = result + digit * (i % base), i // base, digit / base
        return result

    i = np.arange(1, SQUARE**2 + 1)
    x = np.c_[radical_inverse(i, 2), radical_inverse(i, 3)]
    return x, rim(x, 0, 1, 1 / SQUARE)


def graded(ratio, random):
    """A wedge in which spacing grows like the distance from its tip: exp() of a jittered lattice, which it keeps square."""
    across = 40
    step = np.log(10) / across
    along = round(np.log(ratio) / step)
    s = (grid(along, across) + random.uniform(-0.2, 0.2, (along * across, 2))) * step
    held = ((s < step) | (s > [np.log(ratio) - step, np.log(10) - step])).any(1)
    return np.exp(s[:, :1]) / ratio * np.c_[np.cos(s[:, 1]), np.sin(s[:, 1])], held


def annulus(random):
    dx = 0.03
    x = (grid(68, 68) - 34 + random.uniform(-0.25, 0.25, (68 * 68, 2))) * dx
    r = np.hypot(*x.T)
    circle = lambda r: r * np.array([[np.cos(t), np.sin(t)] for t in np.arange(0, 2 * np.pi, 2 * np.pi / round(2 * np.pi * r / dx))])
    inside, walls = x[(r > 0.4 + 0.6 * dx) & (r < 1 - 0.6 * dx)], np.r_[circle(0.4), circle(1)]
    return np.r_[inside, walls], np.r_[np.zeros(len(inside)), np.ones(len(walls))]


def l_shape(random):
    x = (grid(60, 60) + random.uniform(-0.25, 0.25, (3600, 2))) / 30
    x = x[~((x > 1).all(1))]
    held = rim(x, 0, 2, 1 / 30) | ((x > 1 - 1 / 30).all(1))
    return x, held


def letters(_):
    x = np.loadtxt(HERE / "data" / "letters.csv", delimiter=",", skiprows=1)
    return x, (x[:, 0] <= 2.101) | (x[:, 0] >= 2.449)


def thinned(candidates, distance):
    """Of points in turn those that keep their distance from the ones before."""
    kept = candidates[:1]
    for x in candidates[1:]:
        if ((kept - x) ** 2).sum(1).min() > distance**2:
            kept = np.r_[kept, x[None]]
    return kept


def on_surface(equation, distance, random):
    """Points of a star-shaped surface, a distance apart."""
    direction = random.normal(size=(20000, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    low, high = np.zeros(len(direction)), np.full(len(direction), 3.0)
    for _ in range(60):
        middle = (low + high) / 2
        inside = equation(middle[:, None] * direction) < 0
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    x = thinned(low[:, None] * direction, distance)
    return x, np.zeros(len(x))


def ball(x):
    return (x**2).sum(1) - 1


def animal(x):
    """A body with a head, two ears and a tail, in the way of the Stanford bunny."""
    bumps = [((0.5, 0.0, 0.8), 0.5, 0.9), ((0.35, 0.25, 1.35), 0.2, 0.5), ((0.35, -0.25, 1.35), 0.2, 0.5), ((-0.9, 0, -0.1), 0.3, 0.5)]
    return (x**2 * [0.9, 1.2, 1.2]).sum(1) - 0.7 - sum(a * np.exp(-((x - c) ** 2).sum(1) / w**2) for c, w, a in bumps)


def sheet(random):
    """Two layers."""
    x = (grid(50, 50, 2) + random.uniform(-0.2, 0.2, (5000, 3))) / 50
    return x, rim(x[:, :2], 0, 1, 1 / 50)


CLOUDS = {"even": lambda r: square(0, r), "jittered": lambda r: square(0.25, r), "random": anywhere, "Halton": halton,
          "graded 10:1": lambda r: graded(10, r), "graded 100:1": lambda r: graded(100, r), "annulus": annulus, "L": l_shape,
          "letters": letters, "sphere": lambda r: on_surface(ball, 0.06, r), "animal's shell": lambda r: on_surface(animal, 0.06, r),
          "thin sheet": sheet}
SURFACES = {"sphere": ball, "animal's shell": animal}


def derivatives(x, k, equation):
    """Gradient and Laplacian of the wave; within a surface, those within it."""
    phase = x @ k + 0.3
    slope, bend = np.cos(phase)[:, None] * k, -np.sin(phase)[:, None, None] * np.outer(k, k)
    if equation is None:
        return slope, np.trace(bend, axis1=1, axis2=2)
    step, I = 1e-4, np.eye(3)
    F = lambda *e: equation(x + step * sum(e))
    g = np.stack([(F(a) - F(-a)) / (2 * step) for a in I], 1)
    h = np.stack([np.stack([(F(a, b) - F(a, -b) - F(-a, b) + F(-a, -b)) / (4 * step**2) for b in I], 1) for a in I], 1)
    size = np.linalg.norm(g, axis=1)
    n = g / size[:, None]
    along = lambda m: np.einsum("ia,iab,ib->i", n, m, n)
    curvature = (np.trace(h, axis1=1, axis2=2) - along(h)) / size  # the divergence of n
    normal = (n * slope).sum(1)
    return slope - normal[:, None] * n, np.trace(bend, axis1=1, axis2=2) - along(bend) - curvature * normal


def run(program, *arguments):
    return subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)


def cell(program, folder, points, scheme, exact, space, surface):
    options = [points, "--scheme", scheme, "--neighbours", SCHEMES.get(scheme, (28, 90))[space],
               "--on-degenerate", "widen", *(["--on-surface"] if surface else [])]
    run(program, "derive", *options, "--field", "u", "-o", folder / "out.csv")
    if not (folder / "out.csv").exists():
        return "error"
    with open(folder / "out.csv") as file:
        rows = list(csv.DictReader(file))
    (folder / "out.csv").unlink()
    column = lambda name: np.array([float(row[name]) for row in rows])
    if scheme.startswith("gradient"):
        off = np.stack([column(f"u_{a}") for a in "xyz"[: exact.shape[1]]], 1) - exact
        largest = np.linalg.norm(exact, axis=1).max()
    else:
        off, largest = (column("lap_u") - exact)[:, None], np.abs(exact).max()
    answered = np.isfinite(off).all(1)
    text = f"{np.sqrt((off[answered]**2).sum(1).mean()) / largest:.1e}" if answered.any() else "none"
    if 0 < answered.sum() < len(rows):
        text += f" - {len(rows) - answered.sum()}"
    if scheme.startswith("laplacian") and answered.any():
        run(program, "inspect", *options, "--fixed", "held", "--report", folder / "report.json")
        if json.loads((folder / "report.json").read_text())["inspection"]["verdict"]["grows"]:
            text += " grows"
    return text


def table(program, folder, clouds, schemes):
    print("| points | number | " + " | ".join(schemes) + " |\n|---|---|" + "---|" * len(schemes))
    for name, (x, held, k, slope, laplacian) in clouds.items():
        points = folder / "points.csv"
        np.savetxt(points, np.c_[x, np.sin(x @ k + 0.3), held], delimiter=",", comments="", fmt="%.17g",
                   header=",".join("xyz"[: x.shape[1]]) + ",u,held")
        cells = []
        for scheme in schemes:
            exact = slope if scheme.startswith("gradient") else laplacian
            cells.append(cell(program, folder, points, scheme, exact, x.shape[1] == 3 and name not in SURFACES, name in SURFACES))
        print(f"| {name} | {len(x):,} | " + " | ".join(cells) + " |", flush=True)
    print()


def main():
    program = sys.argv[1] if len(sys.argv) > 1 else HERE.parent / "build" / "release" / "apps" / "gradpsi"
    schemes = sys.argv[2:] or list(SCHEMES)
    clouds = {}
    for name, make in CLOUDS.items():
        x, held = make(np.random.default_rng(1))
        extent = np.ptp(x, axis=0).max()
        k = np.array([0.8, 0.6, -0.5])[: x.shape[1]] * 2 * np.pi / (0.5 * extent)
        clouds[name] = x, held, k, *derivatives(x, k, SURFACES.get(name))
    with tempfile.TemporaryDirectory() as folder:
        for kind in ["gradient", "laplacian"]:
            if chosen := [scheme for scheme in schemes if scheme.startswith(kind)]:
                table(program, Path(folder), clouds, chosen)


if __name__ == "__main__":
    main()
