"""
An LED and a sensor on the same two yarns
=========================================

Power and ground run along two groups of warp yarns. A sensor in the middle and an LED at the far end share them, and
when the LED goes on, the sensor's supply falls: how much, and how much more when the fabric is stretched?
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

import circuittex as ct

# %%
# Ten yarns of power, ten of ground, and insulating ones between them; weft yarns join the yarns of a group by their
# crossings, and are cut between the groups. Ry grows with strain, Rc falls.

strains = np.linspace(0.0, 0.2, 5)
fabric = ct.CellResistances(
    warp=0.5 * (1 + 2 * strains), weft=np.full(5, 0.5), crossing=20.0 / (1 + 3 * strains), strain=tuple(strains)
)
electrodes = (
    ct.Electrode("supply", ends=("warp21..30-",), voltage=5.0),
    ct.Electrode("ground", ends=("warp1..10-",), voltage=0.0),
    ct.Electrode("sensor_plus", rectangle=(98, 44, 102, 48)),
    ct.Electrode("sensor_minus", rectangle=(98, 12, 102, 16)),
    ct.Electrode("led_plus", rectangle=(192, 48, 196, 52)),
    ct.Electrode("led_minus", rectangle=(192, 8, 196, 12)),
)
panel = ct.Panel(
    *((30, 100), fabric, electrodes),
    pitch=2.0,
    insulating=("warp11..20",),
    cuts=(ct.Cut(line=((0, 30), (200, 30))),),
)

# %%
# The LED is a diode, I = I0 (exp(V / 52 mV) - 1), behind 100 ohm. What the fabric gives it falls from 5 V in
# proportion to its current.


def supplies(strain):
    """The LED's current, and the sensor's voltage with the LED off and on."""
    stretched = replace(panel, strain=strain)
    off = ct.solve_panel(stretched)
    volt = dict(zip(off.electrodes, off.voltage, strict=True))
    fed = {"led_plus": -1.0, "led_minus": 1.0}
    loaded = ct.solve_panel(
        replace(stretched, electrodes=tuple(replace(each, current=fed.get(each.name)) for each in electrodes))
    )
    drop = off.voltage - loaded.voltage  # V for each ampere through the LED
    source = drop[4] - drop[5]
    current = brentq(lambda i: 5.0 - (source + 100.0) * i - 0.052 * np.log1p(i / 1e-20), 0.0, 0.05)
    return current, volt["sensor_plus"] - volt["sensor_minus"], 5.0 - current * (drop[2] - drop[3])


found = np.array([supplies(strain) for strain in strains])
for strain, (current, off, on) in zip(strains, found, strict=True):
    print(f"{strain:5.1%}: LED {1e3 * current:.0f} mA, sensor {off:.3f} V with the LED off, {on:.3f} V with it on")

# %%

figure, axes = plt.subplots(layout="constrained")
axes.plot(100 * strains, found[:, 1], "o-", label="LED off")
axes.plot(100 * strains, found[:, 2], "s-", label="LED on")
axes.set(xlabel="stretch, %", ylabel="supply of the sensor, V")
axes.legend()
