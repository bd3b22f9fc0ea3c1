"""
An LED and a sensor on the same two yarns
=========================================

Power and ground run along two groups of warp yarns. A sensor in the middle and an LED at the far end share them, and
when the LED goes on, the sensor's supply falls: how much, and how much more when the fabric is stretched?
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import circuittex as ct

# %%
# Ten yarns of power, ten of ground, and insulating ones between them; weft yarns join the yarns of a group by their
# crossings, and are cut between the groups. Ry grows with strain, Rc falls.

known = np.linspace(0.0, 0.2, 5)
fabric = ct.CellResistances(
    warp=0.5 * (1 + 2 * known), weft=np.full(5, 0.5), crossing=20.0 / (1 + 3 * known), strain=tuple(known)
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
    name="supply",
)

# %%
# Stretched by 0, 10 and 20 %, the panel becomes a sub-circuit with its electrodes as pins, exactly reduced. Around it:
# an LED behind 100 ohm that a switch turns on for 10 ms, and a sensor that is a resistor of 5 kilohm.


def sensor_supply(strain):
    """Time, the sensor's supply, and the LED's current."""
    part = ct.panel_netlists(ct.solve_panel(replace(panel, strain=strain))).ports
    deck = f"""* an LED and a sensor
{part}
Xpanel supply 0 sensor_plus sensor_minus led_plus led_minus panel_supply
Vsupply supply 0 5
Rsensor sensor_plus sensor_minus 5k
Rled led_plus anode 100
Dled anode cathode led
Sled cathode led_minus gate 0 switch
Vgate gate 0 PULSE(0 1 5m 10u 10u 10m 30m)
.model led D(is=1e-20 n=2)
.model switch SW(vt=0.5 ron=0.1 roff=1e9)
.tran 0.1m 20m
.end
"""
    plot = ct.run_deck(deck).plots[-1]
    plus, minus, led, anode = plot.voltage(["sensor_plus", "sensor_minus", "led_plus", "anode"]).T
    return plot.sweep, plus - minus, (led - anode) / 100.0


figure, axes = plt.subplots(layout="constrained")
for strain in (0.0, 0.1, 0.2):
    time, volts, current = sensor_supply(strain)
    off, on = volts[time < 4e-3][-1], volts[time < 14e-3][-1]
    print(
        f"stretch {strain:4.0%}: LED {1e3 * current.max():.1f} mA; sensor {off:.3f} V, and {on:.3f} V with the LED on"
    )
    axes.plot(1e3 * time, volts, label=f"stretched by {strain:.0%}")
axes.set(xlabel="time, ms", ylabel="supply of the sensor, V")
axes.legend()

# %%
# The voltages on the stretched panel while the LED is on. White frames are the pads; between the two groups nothing
# conducts.

loads = {"sensor_plus": -1e-3, "sensor_minus": 1e-3, "led_plus": -current.max(), "led_minus": current.max()}
loaded = tuple(replace(each, current=loads.get(each.name)) for each in electrodes)
voltages = ct.panel_figure(ct.solve_panel(replace(panel, strain=0.2, electrodes=loaded)), "voltage")
