"""
A stretch sensor in a bridge with an amplifier
==============================================

A piece of fabric in a chest strap is stretched by every breath. It is one arm of a Wheatstone bridge, and an
instrumentation amplifier of three operational amplifiers makes a signal of a volt of it.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import circuittex as ct

# %%
# A small fabric, stretched in four steps, becomes a library of parts. In the part that ends in `_v`, strain is the
# voltage of a pin: 1 V is 100 %.

stretch = ct.uniaxial("stretch", ct.equal_steps(0.04, 4))
study = ct.run_study(ct.plain_weave("paper-code", yarns=2, rows=(1,), loading=(stretch,)))
library = tempfile.TemporaryDirectory()
parts = {cell.name: cell for cell in ct.export_library(study, library.name, dialects=("ngspice",))}
sensor = parts["fabric_ports_stretch_v"]

# %%
# Current goes into one yarn and out of its neighbour, hence through contacts, which stretch presses together. The
# resistances between these two pins by themselves say what the amplifier should give: gain times the difference
# between the two halves of the bridge. The other three arms are the resistance at rest.

ends = ("warp1_minus", "warp2_minus")
strains = np.array([record.strain for record in study.records])
ohms = np.array([record.ports.between(*ends) for record in study.records])
supply, gain, rest = 3.3, 1 + 2 * 20.0 / 10.0, ohms[0]
expected = gain * supply * (0.5 - ohms / (ohms + rest))

# %%
# The circuit. Each operational amplifier has a gain of 100,000 and a bandwidth of 1 MHz; two of them amplify by
# 1 + 2 x 20k / 10k, the third takes the difference. Fifteen breaths a minute stretch the strap by 0 to 4 %.

fabric = ct.instance(sensor, "X1", {ends[0]: "sense", ends[1]: "0", "strain": "strain", "out_of_range": "flag"})
deck = f"""* a breathing sensor
.include {Path(library.name) / sensor.file}
.subckt opamp plus minus out
G1 0 x plus minus 1m
R1 x 0 100meg
C1 x 0 159p
E1 out 0 x 0 1
.ends opamp
Vsupply supply 0 {supply}
Vstrain strain 0 SIN(0.02 0.02 0.25 0 0 -90)
R1 supply sense {rest}
R2 supply half {rest}
R3 half 0 {rest}
{fabric}
Xa half a1 a opamp
Xb sense b1 b opamp
Ra a a1 20k
Rg a1 b1 10k
Rb b b1 20k
R4 a c 10k
R5 c 0 10k
R6 b d 10k
R7 d out 10k
Xc c d out opamp
.tran 20m 8
.end
"""
answer = ct.run_deck(deck).plots[-1]
time = answer.sweep
strain, sense, half, out = answer.voltage(["strain", "sense", "half", "out"]).T

# %%
# Breathing in, at each strain of the study: what the amplifier gives, and what the resistances say.

breath = time <= 2.0
given = np.interp(strains, strain[breath], out[breath])
print("stretch  fabric, ohm  amplifier, V  from the resistances, V")
for row in zip(100 * strains, ohms, given, expected, strict=True):
    print("{:5.1f} % {:12.1f} {:13.5f} {:24.5f}".format(*row))
print(f"largest difference: {abs(given - expected).max():.1e} V of {np.ptp(out):.3f} V")

figure, (above, below, curve) = plt.subplots(1, 3, figsize=(11, 3.6), layout="constrained")
above.plot(time, 100 * strain)
above.set(title="what the chest does", xlabel="time, s", ylabel="stretch, %")
below.plot(time, out, label="amplifier")
below.plot(time, half - sense, label="bridge")
below.set(title="what comes out", xlabel="time, s", ylabel="voltage, V")
below.set_ylim(top=1.35)
below.legend(loc="upper center", ncols=2)
curve.plot(100 * strain, out, label="transient")
curve.plot(100 * strains, expected, "o", label="from the resistances")
curve.set(title="one against the other", xlabel="stretch, %", ylabel="amplifier, V")
curve.legend()
library.cleanup()
