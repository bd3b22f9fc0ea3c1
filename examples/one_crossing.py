"""
One crossing, looked at closely
===============================

Two yarns of ten fibrils cross once. Which fibrils touch, where, and how hard?
"""

import matplotlib.pyplot as plt
import numpy as np

import circuittex as ct

# %%
# The frozen contact state lists every contact point of the relaxed fibrils.

design = ct.plain_weave("paper-code", yarns=1)
mesh = ct.build_mesh(design)
relaxed = ct.relax(mesh, design)
contacts = ct.contacts_of(design, mesh, relaxed.configuration)
between = mesh.yarn[contacts.fibril_a] != mesh.yarn[contacts.fibril_b]

# %%
# Every pair is integrated from both sides with half the weight: the sum over all points is the force between the
# yarns.

force = float(np.sum((contacts.line_load * contacts.weight)[between]))
pairs = {frozenset(pair) for pair in zip(contacts.fibril_a[between], contacts.fibril_b[between], strict=True)}
print(f"{between.sum()} contact points of {len(pairs)} pairs of fibrils press the yarns together with {force:.3f} N")
print(f"largest half-width {1e3 * contacts.width.max():.1f} um, deepest overlap {-1e3 * contacts.gap.min():.1f} um")

# %%
# The places of the contact points in the plane of the fabric.

place = ct.contact_places(contacts, relaxed.configuration)[:, :2]
figure, axes = plt.subplots(layout="constrained")
within = axes.scatter(*place[~between].T, s=4, color="0.8", label="within a yarn")
dots = axes.scatter(*place[between].T, s=14, c=contacts.line_load[between], label="between the yarns")
figure.colorbar(dots, label="line load, N/mm")
axes.set(xlabel="x, mm", ylabel="y, mm", aspect="equal")
axes.legend()
