"""
A heating panel with a tear: where does it get hot?
===================================================

Two bars feed the warp yarns of a heating panel. A tear cuts some of them in the middle. Their current goes round it
through crossings and weft yarns, so that the panel stays warm behind the tear, and gets hot beside it.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from scipy.fft import dctn, idctn

import circuittex as ct

# %%
# The fabric: 60 x 90 yarns, 2 mm apart. Ry and Rc are stated here; `ct.cells_of_study` takes them from a run.

bars = (
    ct.Electrode("left", edge="left", voltage=2.0),
    ct.Electrode("right", edge="right", voltage=0.0),
)
whole = ct.Panel((60, 90), ct.CellResistances(warp=0.28, weft=0.28, crossing=1.5), bars, pitch=2.0)
torn = replace(whole, cuts=(ct.Cut(line=((90, 40), (90, 80))),))

# %%
# Currents and heat, with and without the tear. The power falls less than the number of whole yarns does: a third.

before, after = ct.solve_panel(whole), ct.solve_panel(torn)
print(f"whole: {before.power:.1f} W, hottest cell {1e3 * before.heat.max():.1f} mW")
print(f"torn:  {after.power:.1f} W, hottest cell {1e3 * after.heat.max():.1f} mW")

# %%
# Its temperature, with 10 W/(m2 K) lost to the air on each side, and a fabric of 0.5 mm and 0.2 W/(m K) that spreads
# the heat: h T - k t (T_xx + T_yy) = q is a division in the cosine transform.

loss, spread = 2 * 10e-6, 0.2e-3 * 0.5  # W/(mm2 K), W/K
q = after.heat / torn.pitch**2
n, m = torn.shape
waves = np.add.outer(
    (2 - 2 * np.cos(np.pi * np.arange(n) / n)) / torn.pitch**2,
    (2 - 2 * np.cos(np.pi * np.arange(m) / m)) / torn.pitch**2,
)
warmer = idctn(dctn(q) / (loss + spread * waves))
print(f"{warmer.mean():.0f} K warmer than the air on average, {warmer.max():.0f} K at most")

width, height = torn.size
figure, axes = plt.subplots(layout="constrained")
image = axes.imshow(warmer, origin="lower", extent=(0, width, 0, height), cmap="inferno")
axes.plot((90, 90), (40, 80), "w--", label="tear")
axes.set(title="temperature above that of the air", xlabel="x, mm", ylabel="y, mm")
axes.legend(facecolor="0.5")
figure.colorbar(image, ax=axes, label="K", shrink=0.8)

# %%
# Heat before it spreads, and the gradient of the resistance between the bars: the crossings near the ends of the tear
# are what counts.

heat = ct.panel_figure(after, "heat")
gradient = ct.panel_gradient(after, "left", "right")
print(
    f"R = {gradient.resistance:.3f} ohm; a crossing beside the tear changes it by {gradient.crossing.max():.1e} ohm/ohm"
)
