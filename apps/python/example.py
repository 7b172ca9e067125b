import gradpsi
import numpy as np

cloud = gradpsi.read_cloud("apps/data/letters.csv")  # 3,993 points in 3D
near = gradpsi.find_neighbours(cloud, 3 * cloud.spacing())
gradient, laplacian = gradpsi.assemble(["gradient-direct-soc", "laplacian-mixed-zoc"], cloud, near)

u = np.sum(cloud.positions**2, axis=1)  # x^2 + y^2 + z^2
u_x = gradient.axes[0] @ u  # a scipy.sparse.csr_matrix over the library's memory
print(f"du/dx in [{u_x.min():.2g}, {u_x.max():.2g}]")

x = cloud.positions[:, 0]
T = np.where(x <= 2.101, 1.0, 0.0)  # one end at 1, the other at 0
ends = (x <= 2.101) | (x >= 2.449)
heat = gradpsi.ImplicitDiffusion(cloud, laplacian, time_step=0.01, fixed=ends)
for _ in range(200):
    T = heat.step(T)  # factorised once
print(f"{heat.solver.method}, mean temperature {T.mean():.3f}")
