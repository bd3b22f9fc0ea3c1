"""
The same fabric in KiCad's ngspice
==================================

KiCad simulates with ngspice in its mode for LTspice and PSpice, `ngbehavior=ltpsa`. The netlist of the example project
that comes with a library is run in this mode, and compared with the sub-circuit called by hand in plain ngspice.
"""

import subprocess
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import circuittex as ct

# %%
# A small fabric as a library. `kicad/example` in it is a project whose sheet has the fabric in a divider, while strain
# goes through its range ten times a second; `fabric_example.cir` is the netlist of this sheet, by the
# rules of KiCad, which itself is not run here.

stretch = ct.uniaxial("stretch", ct.equal_steps(0.04, 2))
study = ct.run_study(ct.plain_weave("paper-code", yarns=2, rows=(1,), loading=(stretch,)))
library = tempfile.TemporaryDirectory()
parts = {cell.name: cell for cell in ct.export_library(study, library.name, dialects=("ngspice",))}
project = Path(library.name) / "kicad" / "example"
netlist = (project / "fabric_example.cir").read_text()
print(netlist)

# %%
# In KiCad's mode, as a command.


def simulated(deck, *options):
    """Time, the tap of the divider and the strain."""
    subprocess.run(["ngspice", "-b", *options, "-r", "answer.raw", deck], cwd=project, check=True, capture_output=True)
    plot = ct.read_raw(project / "answer.raw")[-1]
    return plot.sweep, *plot.voltage(["sense", "strain"]).T


in_kicad = simulated("fabric_example.cir", "-D", "ngbehavior=ltpsa")

# %%
# By hand: the supply and the resistor of the sheet, and the sub-circuit with its pins by name.

resistor = float(netlist.split("R1 supply sense ")[1].split()[0])
ends = ("warp1_minus", "warp2_minus")
fabric = ct.instance(parts["fabric_ports_stretch_v"], "X1", {ends[0]: "sense", ends[1]: "0", "strain": "strain"})
(project / "by_hand.cir").write_text(f"""* by hand
.include ../../ngspice/fabric_ports_stretch_v.lib
Vsupply supply 0 3.3
R1 supply sense {resistor}
{fabric}
Vstrain strain 0 SIN(0.02 0.02 10 0 0 -90)
.tran 1m 100m
.end
""")
by_hand = simulated("by_hand.cir")

# %%
# The same numbers, and those of the resistances of the study.

ohms = np.array([record.ports.between(*ends) for record in study.records])
strains = np.array([record.strain for record in study.records])
divided = 3.3 * ohms / (ohms + resistor)
times = np.arccos(1 - strains / 0.02) / (2 * np.pi * 10)
print("stretch  in KiCad's mode, V  by hand, V  from the resistances, V")
columns = [np.interp(times, answer[0], answer[1]) for answer in (in_kicad, by_hand)]
for row in zip(100 * strains, *columns, divided, strict=True):
    print("{:5.1f} % {:19.5f} {:11.5f} {:24.5f}".format(*row))

figure, (time, strain) = plt.subplots(1, 2, figsize=(9, 3.8), layout="constrained")
for (seconds, tap, stretched), style, label in ((in_kicad, "-", "KiCad's mode"), (by_hand, "--", "by hand")):
    time.plot(1e3 * seconds, tap, style, label=label)
    strain.plot(100 * stretched, tap, style, label=label)
strain.plot(100 * strains, divided, "ko", label="from the resistances")
time.set(xlabel="time, ms", ylabel="tap of the divider, V")
strain.set(xlabel="stretch, %", ylabel="tap of the divider, V")
time.legend()
strain.legend()
library.cleanup()
