"""A cell that is computed in a second, as the text of a design."""

SMALL = """format = 1
name = "Small study"

[materials.fibril]
youngs_modulus = "10 MPa"
poisson_ratio = 0.0
density = "1 g/mm3"
electrical_conductivity = "10 S/mm"
thermal_conductivity = "1 W/(mm K)"

[yarns.conductive]
rows = [1]
radius = "0.15 mm"
spacing = "0.3 mm"
material = "fibril"

[weave]
draft = [[0, 1], [1, 0]]
warp = "conductive"
weft = "conductive"
pitch = "2 mm"
amplitude = "0.2 mm"

[contact]
penalty = "5 N/mm2"
conductivity = "0.01 S/mm2"
heat_transfer = "0.1 W/(mm2 K)"

[terminals]
common = ["warp1+"]
straight = ["warp1-"]
parallel = ["warp2-"]
perpendicular = ["weft1+"]

[[probes]]
name = "straight"
source = "straight"
sink = "common"
voltage = "1 V"

[[probes]]
name = "parallel"
source = "parallel"
sink = "common"
voltage = "1 V"

[[probes]]
name = "perpendicular"
source = "perpendicular"
sink = "common"
voltage = "1 V"

[numerics]
elements = 8
"""

BARE = SMALL[: SMALL.index("[terminals]")] + SMALL[SMALL.index("[numerics]") :]
"""The same without probes: half the pictures of its report, and nothing to simulate."""

NEVER = SMALL.replace("elements = 8", "elements = 8\nmax_iterations = 1")
"""The same with an iteration too few for any equilibrium."""
