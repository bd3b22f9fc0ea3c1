"""
Monte Carlo over the corners of an ensemble
===========================================

No two pieces of fabric are packed alike. The library of an ensemble has corners, and a part with a parameter `mc`
that a circuit varies as it varies the tolerance of any other part: here, in a divider.
"""

import tempfile
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import circuittex as ct

# %%
# Six random packings of a small fabric, each stretched by 2 and 4 %. `circuittex ensemble` computes many more side
# by side, and `ct.complete_members` reads them.

stretch = ct.uniaxial("stretch", (0.02, 0.04))
design = ct.plain_weave("paper-code", yarns=2, rows=(1,), loading=(stretch,))
packings = [ct.Packing(lateral=0.02, vertical=0.02, seed=seed) for seed in range(6)]
members = [ct.run_study(replace(design, packing=packing)) for packing in packings]

library = tempfile.TemporaryDirectory()
cells = ct.export_library(members[0], library.name, dialects=("ngspice",), members=members)
parts = {cell.name: cell for cell in cells}

# %%
# The divider: 3.3 V, 20 kilohm, and the fabric from one yarn to its neighbour. A deck holds any number of them.

ends, supply, fixed, strain = ("warp1_minus", "warp2_minus"), 3.3, 20e3, 0.04


def divider(number, part, nodes, **parameters):
    fabric = ct.instance(part, f"X{number}", {ends[0]: f"sense{number}", ends[1]: "0", **nodes}, **parameters)
    return f"{fabric}\nR{number} supply sense{number} {fixed}\n"


def simulated(part_names, dividers, analysis):
    includes = "".join(f".include {Path(library.name) / parts[name].file}\n" for name in part_names)
    sources = f"Vsupply supply 0 {supply}\nVstrain strain 0 {strain}\n"
    plot = ct.run_deck(f"* dividers\n{includes}{sources}{''.join(dividers)}{analysis}\n.end\n").plots[-1]
    return plot.sweep, plot.voltage([f"sense{number}" for number in range(len(dividers))])


# %%
# The corners: the 5th, 50th and 95th percentile of resistance, while the pin of strain is swept.

names = [f"fabric_ports_{corner}_stretch_v" for corner in ("p05", "p50", "p95")]
dividers = [divider(number, parts[name], {"strain": "strain"}) for number, name in enumerate(names)]
swept, corners = simulated(names, dividers, f".dc Vstrain 0 {strain} 0.001")

# %%
# Monte Carlo: three hundred dividers at 4 %, whose `mc` is drawn from the standard normal distribution.

name = "fabric_ports_mc_stretch_s"
draws = np.random.default_rng(1).standard_normal(300)
dividers = [divider(number, parts[name], {}, strain=strain, mc=mc) for number, mc in enumerate(draws)]
drawn = simulated([name], dividers, ".op")[1][0]

# %%
# In a corner all resistors are at their percentile at once, which no packing is: corners are on the safe side.

ohms = np.array([[record.ports.between(*ends) for record in member.records] for member in members])
packed = supply * ohms / (ohms + fixed)
print(f"stretched by {strain:.0%}, the divider gives")
print(f"  the six packings     {packed[:, -1].min():.4f} to {packed[:, -1].max():.4f} V")
print("  corners p05 p50 p95  {:.4f}, {:.4f}, {:.4f} V".format(*corners[-1]))
print("  300 draws of mc      {:.4f}, {:.4f}, {:.4f} V at 5, 50, 95 %".format(*np.percentile(drawn, (5, 50, 95))))

figure, (curve, histogram) = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained", sharey=True)
curve.fill_between(100 * swept, corners[:, 0], corners[:, 2], alpha=0.25, label="corners p05 to p95")
curve.plot(100 * swept, corners[:, 1], label="corner p50")
for record, volts in zip(members[0].records, packed.T, strict=True):
    curve.plot(np.full(len(volts), 100 * record.strain), volts, "k.", label="packings" if not record.strain else None)
curve.set(title="stretched", xlabel="stretch, %", ylabel="tap of the divider, V")
curve.legend()
histogram.hist(drawn, bins=20, orientation="horizontal")
for volts, corner in zip(corners[-1], ("p05", "p50", "p95"), strict=True):
    histogram.axhline(volts, color="black", linewidth=1)
    histogram.annotate(corner, (1, volts), (4, 0), ("axes fraction", "data"), "offset points", va="center")
histogram.set(title=f"Monte Carlo at {strain:.0%}", xlabel=f"draws, of {len(drawn)}")
library.cleanup()
