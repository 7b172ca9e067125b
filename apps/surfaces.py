#!/usr/bin/env python3
"""Errors of derivatives within the unit sphere, by scheme and number of points.

    python3 apps/surfaces.py [PROGRAM]    (needs numpy; half a minute)

The Laplace-Beltrami operator of u = x y z is -12 u, its gradient along the sphere is that in space less its normal
part. Points lie on a Fibonacci spiral or anywhere (uniformly random); prints a table of root mean square errors over
the largest value, and the orders.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

SCHEMES = {"laplacian-positive": 26, "laplacian-mixed-soc-ls": 26, "laplacian-ls-2": 26, "laplacian-ls-3": 50,
           "laplacian-ls-4": 75, "gradient-ls-2": 26, "gradient-ls-3": 50}  # and neighbours
COUNTS = [1000, 4000, 16000]


def spiral(n):
    i = np.arange(n)
    z, phi = 1 - (2 * i + 1) / n, i * np.pi * (3 - np.sqrt(5))
    return np.c_[np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z]


def anywhere(n):
    x = np.random.default_rng(n).normal(size=(n, 3))
    return x / np.linalg.norm(x, axis=1)[:, None]


def error(program, folder, points, scheme, neighbours):
    x, y, z = points.T
    u = x * y * z
    np.savetxt(folder / "points.csv", np.c_[points, u], delimiter=",", comments="", header="x,y,z,u", fmt="%.17g")
    subprocess.run([program, "derive", folder / "points.csv", "--field", "u", "--scheme", scheme, "--neighbours",
                    str(neighbours), "--on-degenerate", "widen", "--on-surface", "-o", folder / "out.csv"],
                   check=True, stdout=subprocess.DEVNULL)
    found = np.genfromtxt(folder / "out.csv", delimiter=",", names=True)
    if scheme.startswith("laplacian"):
        exact, result = -12 * u[:, None], found["lap_u"][:, None]
    else:
        exact = np.c_[y * z, x * z, x * y] - 3 * u[:, None] * points
        result = np.c_[found["u_x"], found["u_y"], found["u_z"]]
    size = lambda v: np.sqrt((v**2).sum(1))
    return np.sqrt(np.mean(size(result - exact) ** 2)) / size(exact).max()


def main():
    program = sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent.parent / "build" / "release" / "apps" / "gradpsi"
    print("| points | scheme | neighbours |" + "".join(f" {n:,} points |" for n in COUNTS) + " orders |")
    print("|---|---|---|" + "---|" * (len(COUNTS) + 1))
    with tempfile.TemporaryDirectory() as name:
        for points in [spiral, anywhere]:
            for scheme, neighbours in SCHEMES.items():
                found = [error(program, Path(name), points(n), scheme, neighbours) for n in COUNTS]
                orders = ", ".join(f"{np.log2(a / b):.1f}" for a, b in zip(found, found[1:]))
                cells = " | ".join(f"{e:.1e}" for e in found)
                print(f"| {points.__name__} | {scheme} | {neighbours} | {cells} | {orders} |", flush=True)


if __name__ == "__main__":
    main()
