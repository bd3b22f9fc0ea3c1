"""
A loading path of one's own
===========================

Any sequence of in-plane deformation gradients can be a path: here a stretch along x in which the cell is let narrow
by half as much, and the way back.
"""

import matplotlib.pyplot as plt

import circuittex as ct

# %%
# Four states and the same ones backwards.

strains = ct.equal_steps(0.08, 4)
gradients = tuple(((1 + e, 0.0), (0.0, 1 - e / 2)) for e in strains)
path = ct.load_unload(ct.Loading("narrowing", gradients, strains))
study = ct.run_study(ct.plain_weave("paper-code", yarns=2, rows=(1, 2), loading=(path,)))

# %%
# Where fibrils rearrange on the way up, the way back differs. In this small cell it does not.

for record in study.records:
    print(f"{record.name:18} {record.clamp_force[0, 0]:.4f} N  {1e3 * record.currents[1]:.3f} mA")

# %%

figure, (force, current) = plt.subplots(1, 2, figsize=(8, 3.6), layout="constrained")
strain = [record.strain for record in study.records]
force.plot(strain, [record.clamp_force[0, 0] for record in study.records], "o-")
force.set(xlabel="stretch along x", ylabel="clamp force of the warp, N")
current.plot(strain, [1e3 * record.currents[1] for record in study.records], "o-")
current.set(xlabel="stretch along x", ylabel="current to the parallel yarn at 1 V, mA")
