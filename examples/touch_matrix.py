"""
Touch points read by rows and columns, and their cross-talk
===========================================================

A press lowers the resistance of a crossing. Rows and columns share the yarns, so that current finds other ways than
the crossing that is read, and pressed points appear where nobody presses: unless all other yarns are held at the
voltage of the column.
"""

import matplotlib.pyplot as plt
import numpy as np

import circuittex as ct

# %%
# Eight rows and eight columns of poorly joined yarns, each an electrode; three corners of a rectangle are pressed.

count = 8
rows = tuple(ct.Electrode(f"row{k + 1}", ends=(f"warp{k + 1}-",)) for k in range(count))
columns = tuple(ct.Electrode(f"column{k + 1}", ends=(f"weft{k + 1}-",)) for k in range(count))
fabric = ct.CellResistances(warp=2.0, weft=2.0, crossing=50e3)
pressed = ((2, 3), (2, 6), (6, 3))
panel = ct.Panel((count, count), fabric, rows + columns, seams=(ct.Seam(500.0, crossings=pressed),), pitch=5.0)

# %%
# One solution gives the exact matrix between all 16 electrodes, and with it every way to read. With all other yarns
# open, a reading is the resistance between a row and a column. With all others held at 0 V it is the current into the
# column for 1 V at the row: an element of the matrix.

solution = ct.solve_panel(panel)
loose = 1.0 / solution.resistance[:count, count:]
held = -solution.ports.conductance[:count, count:]

# %%
# The fourth corner, (6, 6), is the ghost: three pressed crossings in series join its row and column.

ghost, idle = (5, 5), np.ones((count, count), dtype=bool)
for row, column in (*pressed, (6, 6)):
    idle[row - 1, column - 1] = False
for name, reading in (("others open", loose), ("others held", held)):
    real = reading[1, 2]
    others = reading[idle].max() / real
    print(f"{name}: pressed {1e3 * real:.3f} mS, ghost {reading[ghost] / real:.1%}, others up to {others:.1%}")

# %%

figure, both = plt.subplots(1, 2, figsize=(8, 3.6), layout="constrained")
for axes, title, reading in zip(both, ("others open", "others held at 0 V"), (loose, held), strict=True):
    image = axes.imshow(1e3 * reading, origin="lower", extent=(0.5, count + 0.5, 0.5, count + 0.5), vmin=0.0)
    axes.plot(*np.array(pressed)[:, ::-1].T, "kx", label="pressed")
    axes.plot(6, 6, "wo", fillstyle="none", markersize=14, label="ghost")
    axes.set(title=title, xlabel="column", ylabel="row")
    axes.legend(loc="upper right", facecolor="0.7")
    figure.colorbar(image, ax=axes, label="reading, mS", shrink=0.85)
