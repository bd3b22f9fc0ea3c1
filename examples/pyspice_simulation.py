"""
The fabric among other parts, in PySpice
========================================

A yarn of the fabric and a fixed resistor divide a battery's voltage, and a capacitor smooths what is tapped. The
fabric is a sub-circuit like any other part; ngspice simulates the whole.
"""

import matplotlib.pyplot as plt
import numpy as np
from PySpice.Spice.Netlist import Circuit

import circuittex as ct

# %%
# The detailed circuit of a small cell, with two yarn ends as pins.

design = ct.plain_weave("paper-code", yarns=2, rows=(1,))
mesh = ct.build_mesh(design)
contacts = ct.contacts_of(design, mesh, ct.relax(mesh, design).configuration)
ends = [terminal for terminal in design.terminals if terminal.name in ("parallel", "common")]
fabric = ct.to_pyspice_subcircuit(ct.build_circuit(contacts, ends), "fabric")

# %%
# Pins come in the order of the terminals: `common`, `parallel`.

bench = Circuit("a fabric in a divider")
bench.PulseVoltageSource("battery", "supply", bench.gnd, 0.0, 3.0, pulse_width=1.0, period=2.0)
bench.subcircuit(fabric)
bench.X("fabric", "fabric", bench.gnd, "tap")
bench.R("fixed", "supply", "tap", 10e3)
bench.C("smoothing", "tap", bench.gnd, 1e-6)
answer = bench.simulator().transient(step_time=1e-4, end_time=0.2)

# %%
# The final voltage is what the resistance of the fabric between those ends makes of the divider.

ohm = 1.0 / ct.solve_nodal(ct.build_circuit(contacts, ends), {"parallel": 1.0, "common": 0.0}).port_current[1]
print(f"fabric {ohm:.1f} ohm; tapped {float(answer.tap[-1]):.4f} V, by hand {3.0 * ohm / (ohm + 10e3):.4f} V")

figure, axes = plt.subplots(layout="constrained")
axes.plot(1e3 * np.array(answer.time), np.array(answer.tap))
axes.set(xlabel="time, ms", ylabel="tapped voltage, V")
