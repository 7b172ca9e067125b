#!/usr/bin/env python3
"""Errors of steady diffusion with a flux into curved and cornered walls, by scheme and kind of wall row.

    python3 apps/walls.py [PROGRAM]    (needs numpy; a minute)

-lap u = f with u = sin(2x) cos(1.5y) + 0.3 x^2 on an annulus (flux into the hole, the outer circle held) and on an
L (one side held, flux elsewhere); points jittered by a quarter of their spacing, h/dx = 3. Prints a table of the
largest errors, each the range over three seeds.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

SCHEMES = ["laplacian-positive", "laplacian-mixed-soc-ls", "laplacian-ls-4"]
WALLS = ["positive", "gradient-direct-soc", "gradient-direct-foc"]
SPACINGS = [0.1, 0.05, 0.025]


def lattice(low, high, dx):
    g = np.arange(low, high, dx)
    return np.array(np.meshgrid(g, g)).reshape(2, -1).T


def circle(radius, dx):
    t = 2 * np.pi * np.arange(m := round(2 * np.pi * radius / dx)) / m
    return radius * np.c_[np.cos(t), np.sin(t)]


def annulus(dx, random):
    """Points, normals, who is held."""
    x = lattice(-1, 1, dx) + random.uniform(-dx / 4, dx / 4, (len(lattice(-1, 1, dx)), 2))
    r = np.hypot(*x.T)
    inside, hole, rim = x[(r > 0.4 + 0.6 * dx) & (r < 1 - 0.6 * dx)], circle(0.4, dx), circle(1, dx)
    normals = np.r_[0 * inside, -hole / 0.4, 0 * rim]
    return np.r_[inside, hole, rim], normals, np.r_[np.zeros(len(inside) + len(hole)), np.ones(len(rim))]


def l_shape(dx, random):
    x = lattice(0, 2 + dx / 2, dx)
    x = x[~((x[:, 0] > 1 + dx / 2) & (x[:, 1] > 1 + dx / 2))]
    near = lambda a, b: np.abs(a - b) < dx / 2
    normals = np.zeros_like(x)
    normals[near(x[:, 1], 0)] += [0, -1]
    normals[near(x[:, 1], 2) | (near(x[:, 1], 1) & (x[:, 0] > 1 - dx / 2))] += [0, 1]
    normals[near(x[:, 0], 2) | (near(x[:, 0], 1) & (x[:, 1] > 1 - dx / 2))] += [1, 0]
    held = near(x[:, 0], 0)
    normals[held] = 0
    inner = ~held & (normals == 0).all(1)
    return x + inner[:, None] * random.uniform(-dx / 4, dx / 4, x.shape), normals, held * 1.0


def error(program, folder, shape, dx, seed, scheme, wall):
    points, n, held = shape(dx, np.random.default_rng(seed))
    x, y = points.T
    u = np.sin(2 * x) * np.cos(1.5 * y) + 0.3 * x**2
    slope = np.c_[2 * np.cos(2 * x) * np.cos(1.5 * y) + 0.6 * x, -1.5 * np.sin(2 * x) * np.sin(1.5 * y)]
    f = 6.25 * np.sin(2 * x) * np.cos(1.5 * y) - 0.6
    np.savetxt(folder / "points.csv", np.c_[points, held * u, n, held, (n * slope).sum(1), f], delimiter=",", comments="",
               header="x,y,T,nx,ny,held,g,f", fmt="%.17g")
    subprocess.run([program, "diffuse", folder / "points.csv", "--field", "T", "--scheme", scheme, "--support", str(3 * dx),
                    "--volume", str(dx * dx), "--on-degenerate", "widen", "--fixed", "held", "--normal", "n", "--flux", "g",
                    "--source", "f", "--steady", "--gradient", wall, "-o", folder / "out.csv"],
                   check=True, stdout=subprocess.DEVNULL)
    return np.abs(np.genfromtxt(folder / "out.csv", delimiter=",", names=True)["T"] - u).max()


def main():
    program = sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent.parent / "build" / "release" / "apps" / "gradpsi"
    print("| points | scheme | wall rows |" + "".join(f" dx = {dx} |" for dx in SPACINGS))
    print("|---|---|---|" + "---|" * len(SPACINGS))
    with tempfile.TemporaryDirectory() as name:
        for shape in [annulus, l_shape]:
            for scheme in SCHEMES:
                for wall in WALLS:
                    cells = []
                    for dx in SPACINGS:
                        found = [error(program, Path(name), shape, dx, seed, scheme, wall) for seed in [1, 2, 3]]
                        cells.append(f"{min(found):.1e} to {max(found):.1e}")
                    print(f"| {shape.__name__} | {scheme} | {wall} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
