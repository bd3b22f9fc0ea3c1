"""The plain-weave cell of the paper, from Python."""

from __future__ import annotations

from circuittex.design.checks import one_of, whole
from circuittex.design.contact import ContactLaw
from circuittex.design.experiment import Loading
from circuittex.design.probe import Probe, Terminal
from circuittex.design.statement import Design, Numerics
from circuittex.design.weave import Weave
from circuittex.design.yarn import Material, Yarn, check_rows

_MODULUS = {"paper-code": 10.0, "paper-table": 1.26}  # MPa: what the paper's code used, what its Table I prints
_MOST_YARNS = 100  # a draft of ten thousand crossings


def plain_weave(
    parameters: str = "paper-code",
    *,
    yarns: int = 4,
    rows: tuple[int, ...] = (3, 4, 3),
    loading: tuple[Loading, ...] = (),
) -> Design:
    """The plain-weave cell of the paper with its three probes, or a smaller or larger one of the same kind.

    `parameters` is 'paper-code' (E = 10 MPa, which the paper's figures were computed with) or
    'paper-table' (E = 1.26 MPa, as its Table I prints). The common sink is the + end of the warp yarn
    just below the middle; a single yarn has no parallel neighbour and hence no probe 'parallel'. Cells of
    more than four yarns get as many elements a crossing as the paper's cell has by default.

    >>> [probe.name for probe in plain_weave().probes]
    ['straight', 'parallel', 'perpendicular']
    """
    one_of(parameters, "parameters", tuple(_MODULUS))
    whole(yarns, "yarns", 1, _MOST_YARNS)
    material = Material("fibril", _MODULUS[parameters], 0.0, 1.0, 10.0, 1.0)
    yarn = Yarn("conductive", rows, 0.15, 0.3, 0.3, (material,) * sum(check_rows(rows, "rows")))
    draft = tuple(tuple((i + j) % 2 for j in range(yarns)) for i in range(yarns))
    weave = Weave(draft, (yarn,) * yarns, (yarn,) * yarns, pitch=2.0, amplitude=0.525)
    middle = max(1, yarns // 2)
    sources = {
        "straight": (f"warp{middle}", -1),
        "parallel": (f"warp{middle + 1}", -1),
        "perpendicular": (f"weft{middle}", +1),
    }
    if yarns == 1:
        del sources["parallel"]
    terminals = [Terminal("common", ((f"warp{middle}", +1),))]
    terminals += [Terminal(name, (end,)) for name, end in sources.items()]
    probes = tuple(Probe(name, name, "common", 1.0) for name in sources)
    title = f"Plain weave, {yarns} x {yarns} yarns, {parameters}"
    return Design(
        title,
        weave,
        ContactLaw(5.0, 0.01, 0.1),
        tuple(loading),
        tuple(terminals),
        probes,
        numerics=Numerics(elements=5 * max(4, yarns)),
    )
