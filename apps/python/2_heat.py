"""Heat in a plate: one side held warm, the other cooled by the air, top and bottom insulated.

    python3 apps/python/2_heat.py FOLDER       (default: here) writes 2_heat.png

The cells (# %%) can be run one by one in an editor that knows them.
"""

# %% Points: irregular inside, and a row of them on each side
import sys
from pathlib import Path

import gradpsi
import matplotlib.pyplot as plt
import numpy as np
import scipy.optimize
from scipy.integrate import trapezoid

n = 30
inside = gradpsi.lattice(n, lower=0.5 / n, upper=1 - 0.5 / n, jitter=0.2).positions
along = np.linspace(0, 1, n + 1)
ends = np.array([[x, y] for x in (0, 1) for y in along])
sides = np.array([[x, y] for y in (0, 1) for x in along[1:-1]])
cloud = gradpsi.Cloud(np.vstack([inside, ends, sides]))
x, y = cloud.positions.T

# %% Second order inside and at the walls
near = gradpsi.find_neighbours(cloud, 3 / n)
laplacian = gradpsi.assemble("laplacian-mixed-soc-ls", cloud, near)

cooling = 3.0  # du/dn + cooling u = 0 at x = 1
held = np.flatnonzero(x == 0)
walls = np.flatnonzero((x == 1) | (((y == 0) | (y == 1)) & (x > 0)))
cooled = x[walls] == 1
normals = np.where(cooled[:, None], [1.0, 0.0], np.column_stack([0 * walls, 2 * y[walls] - 1]))
conditions = gradpsi.WallConditions(
    walls,
    normals,
    gradpsi.assemble("gradient-direct-soc", cloud, near, rows=walls),
    transfer=np.where(cooled, cooling, 0.0),
)

# %% Implicit steps
dt = 2e-3
heat = gradpsi.ImplicitDiffusion(
    cloud, laplacian, time_step=dt, fixed=held, fixed_values=np.ones(len(held)), walls=conditions
)
u = np.zeros(len(cloud))
times = [0.02, 0.1, 0.3]
fields = {}
for step in range(1, round(times[-1] / dt) + 1):
    u = heat.step(u)
    for t in times:
        if step == round(t / dt):
            fields[t] = u
print(f"{heat.solver.description}: {heat.solver.reason}")
steady = gradpsi.ImplicitDiffusion(
    cloud,
    laplacian,
    time_step=np.inf,
    fixed=held,
    fixed_values=np.ones(len(held)),
    walls=conditions,
)
fields[np.inf] = steady.step(u)

# %% What is known: a straight line at last, and a sum of decaying sines until then
s = np.linspace(0, 1, 401)
roots = [
    scipy.optimize.brentq(
        lambda m: m * np.cos(m) + cooling * np.sin(m), (k + 0.5) * np.pi, (k + 1) * np.pi
    )
    for k in range(60)
]


def known(points, t):
    line = 1 - cooling / (1 + cooling) * points
    if np.isinf(t):
        return line
    for m in roots:
        wave = np.sin(m * s)
        amount = -trapezoid((1 - cooling / (1 + cooling) * s) * wave, s) / trapezoid(wave**2, s)
        line = line + amount * np.exp(-(m**2) * t) * np.sin(m * points)
    return line


for t, field in fields.items():
    print(f"t = {t:<4}: largest error {np.abs(field - known(x, t)).max():.1e}")

# %% The picture
figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.4), layout="constrained")
image = left.tricontourf(x, y, fields[0.1], levels=np.linspace(0, 1, 21), cmap="inferno")
left.plot(*cloud.positions.T, ".", color="white", markersize=1.2, alpha=0.6)
left.set(
    aspect="equal",
    xlabel="x (left side held at 1, right side cooled)",
    ylabel="y",
    title="u at t = 0.1, and the points",
)
figure.colorbar(image, ax=left, label="u", ticks=np.linspace(0, 1, 6))

colors = plt.cm.viridis(np.linspace(0, 0.85, len(fields)))
for (t, field), color in zip(fields.items(), colors):
    name = "steady" if np.isinf(t) else f"t = {t}"
    right.plot(x, field, ".", color=color, markersize=3, label=name)
    right.plot(s, known(s, t), color=color, linewidth=0.8)
right.plot([], [], color="gray", linewidth=0.8, label="exact")
right.set(
    xlabel="x",
    ylabel="u",
    xlim=(0, 1),
    ylim=(0, 1.02),
    title=f"All {len(cloud)} points, steps of {dt:g}",
)
right.grid(alpha=0.3)
right.legend(markerscale=3)

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
figure.savefig(folder / "2_heat.png", dpi=90)
