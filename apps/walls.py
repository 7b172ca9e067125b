#!/usr/bin/env python3
"""Errors of steady diffusion between curved and cornered walls, by scheme, conditions and kind of wall row.

    python3 apps/walls.py [PROGRAM]    (needs numpy; five minutes)

-lap u = f with u = sin(2x) cos(1.5y) + 0.3 x^2 (+ sin z) on an annulus, a disc, an L and a ball, points jittered by
a quarter of their spacing, h/dx = 3. Walls are fixed; or have a flux n . grad u = g, but for a part that is held; or
exchange, n . grad u + 2 u = g, all around. Prints a table. Its cells have the largest error of three clouds at the
finest spacing, the order from the coarsest to it, and the largest ratio of errors between clouds of one spacing.
"""

import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

SCHEMES = ["laplacian-positive", "laplacian-mixed-soc-ls", "laplacian-ls-4"]
TRANSFER = 2


def lattice(low, high, dx, dimension=2):
    g = np.arange(low, high, dx)
    return np.array(np.meshgrid(*[g] * dimension)).reshape(dimension, -1).T


def jittered(points, dx, random):
    return points + random.uniform(-dx / 4, dx / 4, points.shape)


def circle(radius, dx):
    t = 2 * np.pi * np.arange(m := round(2 * np.pi * radius / dx)) / m
    return radius * np.c_[np.cos(t), np.sin(t)]


def sphere(dx):
    """Points along a spiral at the golden angle (Fibonacci), one per dx^2."""
    k = np.arange(m := round(4 * np.pi / dx**2)) + 0.5
    z, t = 1 - 2 * k / m, np.pi * (1 + 5**0.5) * k
    return np.c_[np.sqrt(1 - z**2) * np.cos(t), np.sqrt(1 - z**2) * np.sin(t), z]


def around(x, walls, normals, held):
    """Points, their normals, 0 inside, and which are held where the others have a flux."""
    inside = np.zeros(len(x), bool)
    return np.r_[x, walls], np.r_[0 * x, normals], np.r_[inside, held]


def annulus(dx, random):
    """The rim is held, the flux into the hole."""
    x = jittered(lattice(-1, 1, dx), dx, random)
    r = np.linalg.norm(x, axis=1)
    hole, rim = circle(0.4, dx), circle(1, dx)
    held = np.r_[np.zeros(len(hole), bool), np.ones(len(rim), bool)]
    return around(x[(r > 0.4 + 0.6 * dx) & (r < 1 - 0.6 * dx)], np.r_[hole, rim], np.r_[-hole / 0.4, rim], held)


def round_body(dx, random, wall):
    """A half is held."""
    x = jittered(lattice(-1, 1, dx, wall.shape[1]), dx, random)
    return around(x[np.linalg.norm(x, axis=1) < 1 - 0.6 * dx], wall, wall, wall[:, 0] < 0)


def disc(dx, random):
    return round_body(dx, random, circle(1, dx))


def ball(dx, random):
    return round_body(dx, random, sphere(dx))


def l_shape(dx, random):
    """The left side is held. Normals at corners are the sum of those of the sides."""
    x = lattice(0, 2 + dx / 2, dx)
    x = x[~((x[:, 0] > 1 + dx / 2) & (x[:, 1] > 1 + dx / 2))]
    near = lambda a, b: np.abs(a - b) < dx / 2
    normals = np.zeros_like(x)
    normals[near(x[:, 1], 0)] += [0, -1]
    normals[near(x[:, 1], 2) | (near(x[:, 1], 1) & (x[:, 0] > 1 - dx / 2))] += [0, 1]
    normals[near(x[:, 0], 2) | (near(x[:, 0], 1) & (x[:, 1] > 1 - dx / 2))] += [1, 0]
    normals[near(x[:, 0], 0)] += [-1, 0]
    inner = (normals == 0).all(1)
    return np.where(inner[:, None], jittered(x, dx, random), x), normals, near(x[:, 0], 0)


# Shapes and their spacings.
SHAPES = [(annulus, [0.1, 0.05, 0.025]), (disc, [0.1, 0.05, 0.025]), (l_shape, [0.1, 0.05, 0.025]), (ball, [0.2, 0.14, 0.1])]
# Conditions and rows at walls.
CONDITIONS = [("fixed", "")] + [(c, w) for c in ["flux", "exchange"] for w in ["positive", "gradient-direct-foc", "gradient-direct-soc"]]


def solution(x):
    """u, its gradient and -lap u."""
    u = np.sin(2 * x[:, 0]) * np.cos(1.5 * x[:, 1]) + 0.3 * x[:, 0] ** 2
    slope = np.c_[2 * np.cos(2 * x[:, 0]) * np.cos(1.5 * x[:, 1]) + 0.6 * x[:, 0], -1.5 * np.sin(2 * x[:, 0]) * np.sin(1.5 * x[:, 1])]
    f = 6.25 * np.sin(2 * x[:, 0]) * np.cos(1.5 * x[:, 1]) - 0.6
    if x.shape[1] == 2:
        return u, slope, f
    return u + np.sin(x[:, 2]), np.c_[slope, np.cos(x[:, 2])], f + np.sin(x[:, 2])


def error(program, folder, shape, dx, seed, scheme, conditions, wall):
    x, n, held = shape(dx, np.random.default_rng(seed))
    u, slope, f = solution(x)
    edge = (n != 0).any(1)
    held = {"fixed": edge, "flux": held, "exchange": 0 * edge}[conditions]
    c = (edge & (conditions == "exchange")) * TRANSFER
    axes = "xyz"[: x.shape[1]]
    names = [*axes, "T", *("n" + a for a in axes), "held", "c", "g", "f"]
    np.savetxt(folder / "points.csv", np.c_[x, held * u, n, held, c, (n * slope).sum(1) + c * u, f], delimiter=",",
               comments="", header=",".join(names), fmt="%.17g")
    rows = ["--normal", "n", "--flux", "g", "--transfer", "c", "--gradient", wall] if wall else []
    done = subprocess.run([program, "diffuse", folder / "points.csv", "--field", "T", "--scheme", scheme, "--support",
                           str(3 * dx), "--volume", str(dx ** len(axes)), "--on-degenerate", "widen", "--fixed", "held",
                           "--source", "f", "--steady", *rows, "-o", folder / "out.csv"],
                          capture_output=True, text=True, env={**os.environ, "PATH": ""})  # without pictures
    if done.returncode != 0:
        return math.inf  # the error is the program's own: the field is beyond all bounds
    return np.abs(np.genfromtxt(folder / "out.csv", delimiter=",", names=True)["T"] - u).max()


def cell(program, folder, shape, spacings, scheme, conditions, wall):
    errors = np.array([[error(program, folder, shape, dx, seed, scheme, conditions, wall) for seed in [1, 2, 3]]
                       for dx in spacings])
    if not np.isfinite(errors).all():
        return f"refused in {np.isinf(errors).sum()} of {errors.size}"
    order = math.log(errors[0].mean() / errors[-1].mean()) / math.log(spacings[0] / spacings[-1])
    return f"{errors[-1].max():.1e}, {order:.1f}, {(errors.max(1) / errors.min(1)).max():.1f}"


def main():
    program = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent.parent / "build" / "release" / "apps" / "gradpsi"
    print("| points | conditions | wall rows | " + " | ".join(s.removeprefix("laplacian-") for s in SCHEMES) + " |")
    print("|---|---|---|" + "---|" * len(SCHEMES))
    with tempfile.TemporaryDirectory() as name:
        for shape, spacings in SHAPES:
            for conditions, wall in CONDITIONS:
                cells = [cell(program.resolve(), Path(name), shape, spacings, s, conditions, wall) for s in SCHEMES]
                print(f"| {shape.__name__.removesuffix('_shape').replace('l', 'L', shape is l_shape)} | {conditions} | {wall} | "
                      + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
