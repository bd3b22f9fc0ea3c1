"""
A fabric built in code
======================

A warp of silver-plated fibrils is woven with a weft of bare nylon: only the warp conducts. The design is made of
the same parts as a TOML file, checked as they are made.
"""

import circuittex as ct

# %%
# Two materials, two kinds of yarns, and which yarn passes over which. Nylon insulates.

silver = ct.Material("silver", 3000.0, 0.0, 1.5e-3, 180.0, 1.0)
nylon = ct.Material("nylon", 3000.0, 0.0, 1.1e-3, 0.0, 3e-4)
conductive = ct.Yarn("conductive", (1, 2, 1), 0.05, 0.1, 0.1, (silver,) * 4)
insulating = ct.Yarn("insulating", (2,), 0.05, 0.1, 0.1, (nylon,) * 2)
weave = ct.Weave(draft=((0, 1), (1, 0)), warp=(conductive,) * 2, weft=(insulating,) * 2, pitch=0.8, amplitude=0.16)

# %%
# Where two fibrils touch they push like Hertz's cylinders, E*/2 for each pair of materials. One probe runs along a
# yarn.

design = ct.Design(
    "Silver warp, nylon weft",
    weave,
    contact=ct.ContactLaw("hertz", conductivity=1000.0, heat_transfer=0.1),
    terminals=(ct.Terminal("left", (("warp1", -1),)), ct.Terminal("right", (("warp1", +1),))),
    probes=(ct.Probe("along", "left", "right", 0.01),),
    numerics=ct.Numerics(elements=12),
)
study = ct.run_study(design)

# %%
# The closed form of an insulated yarn: L / (n sigma A) = 1.6 mm / (4 x 180 S/mm x pi (0.05 mm)^2) = 0.283 ohm.

relaxed = study.records[0]
print(f"warp tension {relaxed.clamp_force[0, 0]:.2f} N, weft tension {relaxed.clamp_force[1, 1]:.2f} N")
print(f"resistance along a warp yarn: {0.01 / relaxed.currents[0]:.4f} ohm")
figure = ct.cell_figure(study, relaxed)
