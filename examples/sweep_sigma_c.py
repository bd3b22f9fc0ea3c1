"""
How well must contacts conduct?
===============================

The mechanics do not know the electrical contact conductivity sigma_c. So the cell is relaxed once, and its contacts
are given one conductivity after another.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import circuittex as ct

# %%
# A small cell of the paper's kind, relaxed.

design = ct.plain_weave("paper-code", yarns=2, rows=(1, 2))
mesh = ct.build_mesh(design)
relaxed = ct.relax(mesh, design)

# %%
# The current between two crossing yarns for each conductivity, at 1 V. It grows in proportion as long as the
# contacts are
# what resists, and levels off where the yarns are.

probe = next(probe for probe in design.probes if probe.name == "perpendicular")
sigma_c = np.geomspace(1e-4, 1e4, 17)
currents = []
for value in sigma_c:
    law = replace(design.contact, conductivity=float(value))
    contacts = ct.contacts_of(replace(design, contact=law), mesh, relaxed.configuration)
    currents.append(ct.solve_fields(contacts, design.terminals, probe).currents[0])

print(f"from {currents[0]:.2e} A at {sigma_c[0]:g} S/mm2 to {currents[-1]:.3f} A at {sigma_c[-1]:g} S/mm2")

# %%

figure, axes = plt.subplots(layout="constrained")
axes.loglog(sigma_c, currents, "o-", label="computed")
axes.loglog(sigma_c[:9], currents[0] * sigma_c[:9] / sigma_c[0], "--", label="in proportion")
axes.set(xlabel="contact conductivity sigma_c, S/mm²", ylabel="current at 1 V, A")
axes.legend()
