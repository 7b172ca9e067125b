"""Which Laplacian? Accuracy against cost, and whether solutions of the heat equation grow.

    python3 apps/python/3_choose_a_scheme.py FOLDER    (default: here) writes 3_choose_a_scheme.png

The cells (# %%) can be run one by one in an editor that knows them.
"""

# %% Irregular points whose outermost layer is held, and a wave
import sys
from pathlib import Path

import gradpsi
import matplotlib.pyplot as plt
import numpy as np

n = 20
cloud = gradpsi.lattice(n, jitter=0.3)
x, y = cloud.positions.T
layer = np.arange(n * n)
free = np.flatnonzero(
    (layer // n > 0) & (layer // n < n - 1) & (layer % n > 0) & (layer % n < n - 1)
)
wave = 2 * np.pi
u = np.sin(wave * x) * np.cos(wave * y)
exact = -2 * wave**2 * u

# %% Every Laplacian with several supports: error, entries a row, spectrum
families = {  # what the schemes have in common, and their sign in the picture
    "zoc": ("tab:red", "o"),
    "soc": ("tab:orange", "s"),
    "soc-ls": ("tab:blue", "D"),
    "ls-3": ("tab:purple", "^"),
    "ls-4": ("tab:green", "v"),
    "positive": ("black", "P"),
}
results = []
for scheme in gradpsi.schemes():
    if scheme.derivative != "laplacian" or scheme.consistency not in families:
        continue
    for ratio in [2.5, 3.0, 3.5, 4.5]:
        near = gradpsi.find_neighbours(cloud, ratio / n)
        op = gradpsi.assemble(scheme, cloud, near, on_degenerate="widen")
        error = (op.matrix @ u - exact)[free]
        spectrum = gradpsi.spectrum(op.matrix[free][:, free], op.volumes[free])
        relative = np.sqrt(np.mean(error**2)) / np.abs(exact).max()
        results.append((scheme, ratio, op, relative, spectrum))

# %% What to take
print("scheme                       h/dx  entries/row    error  grows  largest dt of RK4 / dx^2")
for scheme, ratio, op, error, spectrum in sorted(results, key=lambda r: r[3]):
    step = gradpsi.largest_stable_step(spectrum, "runge-kutta-4") * n**2
    entries = op.matrix.nnz / len(cloud)
    print(
        f"{scheme.name:27} {ratio:5} {entries:12.1f} {error:8.1e}"
        f"  {'yes' if spectrum.grows else 'no':5}  {step:.2f}"
    )

# %% The picture
figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
for name, (color, marker) in families.items():
    mine = [r for r in results if r[0].consistency == name]
    for stable in [True, False]:
        chosen = [r for r in mine if r[4].grows != stable]
        left.loglog(
            [r[2].matrix.nnz / len(cloud) for r in chosen],
            [r[3] for r in chosen],
            marker,
            color=color,
            markerfacecolor=color if stable else "none",
            markersize=6,
            linestyle="none",
            label=f"{name} (degree {mine[0][0].degree})" if stable else None,
        )
left.loglog([], [], "o", color="gray", markerfacecolor="none", label="hollow: solutions grow")
left.set(
    xlabel="entries a row: the cost of a product",
    ylabel="error of the Laplacian, RMS / largest",
    title=f"Every Laplacian, h/dx = 2.5 to 4.5, {n} x {n} points",
)
left.set_xticks([5, 10, 20, 30, 50, 70], [5, 10, 20, 30, 50, 70])
left.minorticks_off()
left.grid(alpha=0.3)
left.legend(fontsize=8, loc="lower left")

for name, color in [("laplacian-direct-soc", "tab:orange"), ("laplacian-mixed-soc-ls", "tab:blue")]:
    spectrum = next(r[4] for r in results if r[0].name == name and r[1] == 3.0)
    values = spectrum.values / n**2
    right.plot(values.real, values.imag, ".", color=color, markersize=4, label=f"{name}, h/dx = 3")
right.axvspan(0, 5, color="tab:red", alpha=0.12, label="growth")
right.set(
    xlabel="real part of the eigenvalues times dx$^2$",
    ylabel="imaginary part times dx$^2$",
    title="The same points, a stable and an unstable scheme",
)
right.set_xlim(-5, 5)  # a few of the unstable scheme lie further left
right.grid(alpha=0.3)
right.legend(fontsize=8)

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
figure.savefig(folder / "3_choose_a_scheme.png", dpi=90)
