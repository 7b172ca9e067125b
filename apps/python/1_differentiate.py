"""The gradient of a field on scattered points, by three schemes.

    python3 apps/python/1_differentiate.py FOLDER       (default: here) writes 1_differentiate.png

The cells (# %%) can be run one by one in an editor that knows them.
"""

# %% Points, and who is near whom
import sys
from pathlib import Path

import gradpsi
import matplotlib.pyplot as plt
import numpy as np

letters = Path(__file__).parents[1] / "data" / "letters.csv"
cloud = gradpsi.read_cloud(letters)  # nodes of a mesh of the letters S, P, H in 3D
near = gradpsi.find_neighbours(cloud, 3 * cloud.spacing())
print(cloud, near)

# %% A field whose gradient is known
x, y, z = cloud.positions.T
u = np.sin(8 * x) * np.cos(7 * y) * np.exp(3 * z)
exact = np.column_stack(
    [
        8 * np.cos(8 * x) * np.cos(7 * y) * np.exp(3 * z),
        -7 * np.sin(8 * x) * np.sin(7 * y) * np.exp(3 * z),
        3 * u,
    ]
)

# %% Its gradient by three schemes: without correction, exact on linear and on quadratic fields
schemes = ["gradient-direct-zoc", "gradient-direct-foc", "gradient-direct-soc"]
operators = gradpsi.assemble(schemes, cloud, near)
size = np.linalg.norm(exact, axis=1).max()
errors = {}
for scheme, op in zip(schemes, operators):
    gradient = gradpsi.multiply(op, u)  # n x 3, all axes with one reading of the pattern
    errors[scheme] = np.linalg.norm(gradient - exact, axis=1) / size
    median, worst = np.median(errors[scheme]), errors[scheme].max()
    print(f"{scheme}: error {median:.1e} (median), {worst:.1e} (worst)")

# %% The picture
figure, (left, right) = plt.subplots(
    1, 2, figsize=(11, 4.2), layout="constrained", width_ratios=[1.45, 1]
)
front = np.flatnonzero(z > z.max() - 1e-6)  # turned by a quarter, so that the letters stand upright
image = left.scatter(y[front], -x[front], c=u[front], s=9, cmap="coolwarm")
some = front[:: max(1, len(front) // 260)]
left.quiver(
    y[some], -x[some], gradient[some, 1], -gradient[some, 0], angles="xy", width=0.0018, alpha=0.8
)
left.set(aspect="equal", xlabel="y", ylabel="-x", title="u on the front faces, its gradient (soc)")
figure.colorbar(image, ax=left, label="u", shrink=0.9)

share = np.arange(1, len(cloud) + 1) / len(cloud)
for scheme, color in zip(schemes, ["tab:red", "tab:orange", "tab:blue"]):
    right.semilogx(np.sort(errors[scheme]), 100 * share, label=scheme, color=color)
right.set(
    xlabel="error of the gradient / largest exact gradient",
    ylabel="points with at most this error (%)",
    xlim=(1e-6, 2),
    ylim=(0, 100),
    title="Errors at all points",
)
right.grid(alpha=0.3)
right.legend(loc="upper left")

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
figure.savefig(folder / "1_differentiate.png", dpi=90)
