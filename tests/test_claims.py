"""The claims of the paper, judged on made-up studies in which each of them is true, half true and false."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from synthetic_study import INSULATED, synthetic_study

from circuittex.base.arrays import Floats
from circuittex.design import Loading, plain_weave, shear, uniaxial
from circuittex.results.claims import CLAIMS, currents, judge, mechanics, network, paper_study, parameter_set
from circuittex.results.claims.claim import AGREES, Finding
from circuittex.results.claims.table import claims_table
from circuittex.results.records import Record, Study

STUDY = synthetic_study(11, contacts=60, loadings=("stretch", "shear"))
Change = Callable[[Record], Record]


def found(find: Callable[..., Finding | None], study: Study) -> Finding:
    paper = paper_study(study)
    assert paper is not None
    finding = find(paper)
    assert finding is not None
    return finding


def changed(change: Change) -> Study:
    return replace(STUDY, records=tuple(change(record) for record in STUDY.records))


def forces(warp: Callable[[Record], list[float]], weft: Callable[[Record], list[float]]) -> Change:
    return lambda record: replace(record, clamp_force=np.array([warp(record), weft(record)]))


def rest_forces(warp: float, weft: float) -> Change:
    return forces(lambda _: [warp, 0.0, 0.0], lambda _: [0.0, weft, 0.0])


def probes(values: Callable[[Record], list[float]]) -> Change:
    """The currents of the three probes, A; the sink takes what the source gives."""

    def change(record: Record) -> Record:
        pairs = zip(record.fields, values(record), strict=True)
        return replace(record, fields=tuple(replace(f, currents=np.array([i, -i])) for f, i in pairs))

    return change


def fits(Ry: Callable[[Record], float], Rc: Callable[[Record], float]) -> Change:
    return lambda record: replace(record, fit=replace(record.fit, Ry=Ry(record), Rc=Rc(record)))


def positions(move: Callable[[Floats], Floats], fibrils: slice) -> Change:
    """Centre lines moved, those of some fibrils only."""
    nodes = np.isin(STUDY.mesh.node_fibril, np.arange(STUDY.mesh.n_fibrils)[fibrils])

    def change(record: Record) -> Record:
        x = STUDY.initial.x.copy()
        x[nodes, 0] = move(x[nodes, 0])
        return replace(record, configuration=replace(record.configuration, x=x))

    return change


def section_force(corner: float, elsewhere: float) -> Change:
    """The largest force in one element at a corner crossing, and in one at the centre; 0.01 N in all others."""
    middle = STUDY.initial.r[STUDY.mesh.elements].mean(axis=1)
    force = np.full(len(middle), 0.01)
    force[np.abs(middle[:, :2] - 3.0).sum(axis=1).argmin()] = corner
    force[np.abs(middle[:, :2]).sum(axis=1).argmin()] = elsewhere

    def change(record: Record) -> Record:
        return replace(record, section_force=force, configuration=STUDY.initial)

    return change


def weak_corners(record: Record) -> Record:
    middle = STUDY.initial.r[STUDY.mesh.elements].mean(axis=1)
    force = np.where((np.abs(middle[:, :2]) > 2.0).all(axis=1), 0.01, 0.05)
    return replace(record, section_force=force, configuration=STUDY.initial)


def along_yarns(share: float) -> Change:
    """Every fibril carries the same current, those of yarns without terminals the given share of the probe's."""

    def change(record: Record) -> Record:
        fields = []
        for f in record.fields:
            ends = {t.name: t.ends for t in STUDY.design.terminals}
            driven = [STUDY.mesh.yarn_names.index(yarn) for name in f.terminals for yarn, _ in ends[name]]
            own = np.isin(STUDY.mesh.yarn[f.fibril[f.segments[:, 0]]], driven)
            fields.append(replace(f, segment_current=np.where(own, 0.1, 0.1 * share) * f.currents[0]))
        return replace(record, fields=tuple(fields))

    return change


def loads(factor: Callable[[Record], float]) -> Change:
    """Contact loads of the relaxed state, times a factor."""
    rest = STUDY.records[0].contacts

    def change(record: Record) -> Record:
        return replace(record, contacts=replace(record.contacts, line_load=rest.line_load * factor(record)))

    return change


def factors(stretched: float, sheared: float) -> Change:
    """How the fibrils conduct along their axes at a strain."""
    size = {"": 1.0, "stretch": stretched, "shear": sheared}

    def change(record: Record) -> Record:
        factor = np.full(len(STUDY.mesh.elements), size[record.loading])
        return replace(record, contacts=replace(record.contacts, axial_factor=factor))

    return change


def other_yarn(conductivity: float) -> Study:
    """The second warp yarn, which the probes hold, and the rest of the fabric conduct differently."""
    mesh = STUDY.mesh
    mesh = replace(mesh, electrical_conductivity=np.where(mesh.yarn == 1, conductivity, mesh.electrical_conductivity))
    own = changed(lambda record: replace(record, contacts=replace(record.contacts, mesh=mesh)))
    return replace(own, mesh=mesh)


def crossing_places(lowest: float, highest: float) -> Change:
    """Ten thousand contacts of all fibrils with crossing ones, between these shares of their length."""
    mesh, rng = STUDY.mesh, np.random.default_rng(5)
    warp, weft = rng.integers(0, 40, 10_000), rng.integers(40, 80, 10_000)
    xi = 8.0 * rng.uniform(lowest, highest, (2, 10_000))
    one = np.ones(10_000)

    def change(record: Record) -> Record:
        contacts = replace(
            record.contacts,
            mesh=mesh,
            fibril_a=warp,
            fibril_b=weft,
            xi_a=xi[0],
            xi_b=xi[1],
            **dict.fromkeys(("gap", "line_load", "width", "weight", "conductance", "heat_conductance"), one),
        )
        return replace(record, contacts=contacts)

    return change


def wavy(record: Record) -> list[float]:
    """Currents that rise with strain, but for one step down in each loading."""
    bump = -0.001 if abs(record.strain - 0.15) < 1e-9 else 0.0
    return [0.9, 0.006 + 0.004 * record.strain + bump, 0.008 + 0.004 * record.strain]


CASES: list[tuple[Callable[..., Finding | None], Study, str]] = [
    (mechanics.flattening, STUDY, "yes"),
    (mechanics.flattening, changed(lambda r: replace(r, levels=3)), "no"),
    (mechanics.tension, changed(rest_forces(2.1, 1.9)), "yes"),
    (mechanics.tension, changed(rest_forces(1.5, 2.0)), "partly"),
    (mechanics.tension, changed(rest_forces(0.2, 0.2)), "no"),
    (mechanics.equal_tension, changed(rest_forces(1.5, 1.501)), "yes"),
    (mechanics.equal_tension, changed(rest_forces(1.5, 1.4)), "partly"),
    (mechanics.equal_tension, changed(rest_forces(1.5, 1.1)), "no"),
    (mechanics.every_fibril_in_tension, STUDY, "yes"),
    (mechanics.every_fibril_in_tension, changed(lambda r: replace(r, section_force=np.ones(1600))), "partly"),
    (mechanics.every_fibril_in_tension, changed(positions(lambda r: r * [0.9, 0.9, 0.0], slice(3))), "partly"),
    (mechanics.every_fibril_in_tension, changed(positions(lambda r: r * [0.9, 0.9, 0.0], slice(None))), "no"),
    (mechanics.corners, changed(section_force(0.07, 0.06)), "yes"),
    (mechanics.corners, changed(section_force(0.05, 0.06)), "partly"),
    (mechanics.corners, changed(weak_corners), "no"),
    (mechanics.both_loadings, STUDY, "yes"),
    (mechanics.both_loadings, replace(STUDY, records=STUDY.records[:-1]), "partly"),
    (mechanics.both_loadings, replace(STUDY, records=STUDY.records[:10] + STUDY.records[11:-1]), "no"),
    (mechanics.out_of_plane, changed(forces(lambda _: [2.0, 0.1, 0.05], lambda _: [0.0, 1.0, 0.02])), "yes"),
    (mechanics.out_of_plane, changed(forces(lambda _: [2.0, 0.1, 0.05], lambda _: [0.0, 1.0, -0.1])), "partly"),
    (mechanics.out_of_plane, changed(forces(lambda _: [2.0, 0.1, 0.05], lambda _: [0.0, 1.0, 0.3])), "no"),
    (mechanics.poisson, changed(forces(lambda _: [2.0, 0.0, 0.0], lambda r: [0.0, 1.0 - r.strain, 0.0])), "yes"),
    (
        mechanics.poisson,
        changed(forces(lambda _: [2.0, 0.0, 0.0], lambda r: [0.0, 1.0 + 0.1 * r.strain, 0.0])),
        "partly",
    ),
    (mechanics.poisson, changed(rest_forces(2.0, 2.0)), "no"),
    (currents.balance, STUDY, "yes"),
    (
        currents.balance,
        changed(lambda r: replace(r, fields=(replace(r.fields[0], currents=np.array([1.0, -0.99])),) * 3)),
        "no",
    ),
    (currents.neighbours, changed(along_yarns(0.06)), "yes"),
    (currents.neighbours, changed(lambda r: along_yarns(0.06 if r.loading == "shear" else 0.04)(r)), "partly"),
    (currents.neighbours, changed(along_yarns(0.04)), "no"),
    (currents.insulated, STUDY, "yes"),
    (currents.insulated, other_yarn(9.0), "no"),
    (currents.insulated_strained, STUDY, "yes"),
    (currents.insulated_strained, changed(factors(1.0, 0.9995)), "partly"),
    (currents.insulated_strained, changed(factors(0.9, 1.0)), "no"),
    (currents.first_is_highest, STUDY, "yes"),
    (currents.first_is_highest, changed(probes(lambda r: [0.5, 4 * r.strain, 0.1])), "partly"),
    (currents.first_is_highest, changed(probes(lambda _: [0.1, 0.2, 0.3])), "no"),
    (currents.first_varies, changed(probes(lambda r: [1.0 + 0.4 * r.strain, 0.1, 0.1])), "yes"),
    (currents.first_varies, changed(probes(lambda r: [1.0 + (r.loading == "shear") * r.strain, 0.1, 0.1])), "partly"),
    (currents.first_varies, changed(probes(lambda r: [1.0 + 0.04 * r.strain, 0.1, 0.1])), "no"),
    (currents.others_drop, changed(probes(wavy)), "yes"),
    (currents.others_drop, changed(probes(lambda r: [0.9, 0.01 + 0.01 * r.strain, 0.01])), "partly"),
    (currents.others_drop, changed(probes(lambda r: [0.9, 0.01 - 0.01 * r.strain, 0.01])), "no"),
    (currents.load_grows, changed(loads(lambda r: 1.0 + r.strain)), "yes"),
    (currents.load_grows, changed(loads(lambda r: 1.0 + r.strain * (r.loading == "shear"))), "partly"),
    (currents.load_grows, changed(loads(lambda r: 1.0 - r.strain)), "no"),
    (currents.reversals, changed(probes(wavy)), "yes"),
    (currents.reversals, changed(lambda r: r if r.loading == "shear" else probes(wavy)(r)), "partly"),
    (currents.reversals, changed(probes(lambda r: [0.9, 0.01 + 0.01 * r.strain, 0.01])), "no"),
    (network.insulated_segment, STUDY, "yes"),
    (network.insulated_segment, other_yarn(8.0), "partly"),
    (network.insulated_segment, other_yarn(4.0), "no"),
    (network.steady_segment, changed(fits(lambda r: INSULATED * (1 - 0.1 * r.strain), lambda _: 200.0)), "yes"),
    (network.steady_segment, changed(fits(lambda r: INSULATED * (1 - 0.5 * r.strain), lambda _: 200.0)), "partly"),
    (network.steady_segment, changed(fits(lambda r: INSULATED * (1 + r.strain), lambda _: 200.0)), "no"),
    (network.sliding_crossing, changed(fits(lambda _: 0.28, lambda r: 200.0 if r.strain < 0.12 else 170.0)), "yes"),
    (network.sliding_crossing, changed(fits(lambda _: 0.28, lambda r: 200.0 - 100.0 * r.strain)), "partly"),
    (network.sliding_crossing, changed(fits(lambda _: 0.28, lambda r: 200.0 - 10.0 * r.strain)), "no"),
    (network.follows_currents, changed(fits(lambda _: 0.28, lambda r: 1.0 / r.currents[1])), "yes"),
    (network.follows_currents, changed(fits(lambda _: 0.28, lambda r: r.currents[1])), "no"),
    (
        network.misfit,
        changed(lambda r: replace(r, fit=replace(r.fit, currents=np.multiply(r.currents, [1, 0.97, 1])))),
        "yes",
    ),
    (
        network.misfit,
        changed(lambda r: replace(r, fit=replace(r.fit, currents=np.multiply(r.currents, 0.998)))),
        "partly",
    ),
    (network.misfit, changed(lambda r: replace(r, fit=replace(r.fit, currents=np.array(r.currents)))), "no"),
    (network.long_crossings, changed(crossing_places(0.0, 1.0)), "yes"),
    (network.long_crossings, changed(crossing_places(0.0, 0.4)), "partly"),
    (network.long_crossings, changed(crossing_places(0.0, 0.1)), "no"),
]


@pytest.mark.parametrize("number", range(len(CASES)))
def test_a_claim_is_judged_by_the_numbers(number: int) -> None:
    find, study, expected = CASES[number]
    assert found(find, study).agrees == expected


def test_every_claim_is_tried_both_ways() -> None:
    for claim in CLAIMS:
        assert {"yes", "no"} <= {expected for find, _, expected in CASES if find is claim.find}, claim.states


def test_findings_print_the_numbers_of_the_study() -> None:
    assert "2.100 N" in found(mechanics.tension, changed(rest_forces(2.1, 1.9))).text
    text = found(currents.others_drop, changed(probes(lambda r: [0.9, 0.01 / (1.0 - r.strain), 0.01]))).text
    assert "-25.0 and +0.0 % in stretch; -25.0 and +0.0 % in shear" in text  # R = (1 - e) 100 ohm: a straight line
    text = found(currents.neighbours, changed(along_yarns(0.06))).text
    assert text.endswith("stretch 6 %, 6 %, 6 %; shear 6 %, 6 %, 6 %")
    force = STUDY.records[0].contacts
    assert f"{np.dot(force.line_load, force.weight):.2f} N at rest" in found(currents.load_grows, STUDY).text


def test_the_papers_cell_is_known_by_what_it_is() -> None:
    design = plain_weave("paper-code")
    assert parameter_set(replace(design, name="mine", probes=(), terminals=())) == "paper-code"
    yarn = replace(design.weave.warp[0], name="silver")
    renamed = replace(design.weave, warp=(yarn,) * 4, weft=(yarn,) * 4)
    assert parameter_set(replace(design, weave=renamed)) == "paper-code"
    thick = replace(renamed, weft=(replace(yarn, name="thick", radius=0.16),) * 4)
    assert parameter_set(replace(design, weave=thick)) is None
    assert parameter_set(replace(design, contact=replace(design.contact, conductivity=0.02))) is None
    assert parameter_set(replace(design, electrical=replace(design.electrical, conduction="current"))) is None
    assert parameter_set(replace(design, packing=replace(design.packing, seed=1, lateral=0.01))) is None
    assert judge(replace(STUDY, design=replace(STUDY.design, weave=thick))) == ()
    assert judge(replace(STUDY, records=())) == ()


def test_probes_are_known_by_their_ends() -> None:
    design = STUDY.design
    turned = replace(design, probes=tuple(replace(p, name=f"p{k}") for k, p in enumerate(design.probes[::-1])))
    paper = paper_study(replace(STUDY, design=turned))
    assert paper is not None
    assert paper.probes == (2, 1, 0)
    missing = replace(STUDY, design=replace(design, probes=design.probes[1:]))
    open_claims = [verdict for verdict in judge(missing) if verdict.finding.agrees == "open"]
    assert {verdict.claim.find.__module__.split(".")[-1] for verdict in open_claims} == {"currents", "network"}


STRAINS = tuple(0.025 * step for step in range(1, 11))


@pytest.mark.parametrize(
    ("loading", "is_stretch", "is_shear"),
    [
        (uniaxial("pull", STRAINS), True, False),
        (uniaxial("pull", STRAINS, "y"), False, False),
        (uniaxial("pull", STRAINS, free="y"), False, False),
        (uniaxial("press", tuple(-e for e in STRAINS)), False, False),
        (uniaxial("cycle", (*STRAINS, 0.1)), False, False),
        (shear("turn", STRAINS), False, True),
    ],
)
def test_loadings_are_known_by_their_gradients(loading: Loading, is_stretch: bool, is_shear: bool) -> None:
    states = zip(loading.gradients, loading.strains, strict=True)
    records = [
        replace(STUDY.records[1], name=f"s{k}", loading=loading.name, strain=e, gradient=np.array(F))
        for k, (F, e) in enumerate(states)
    ]
    study = replace(STUDY, design=replace(STUDY.design, loading=(loading,)), records=(STUDY.records[0], *records))
    paper = paper_study(study)
    assert paper is not None
    assert (len(paper.stretch), len(paper.shear)) == (11 * is_stretch, 11 * is_shear)
    assert {verdict.finding.agrees for verdict in judge(study)} <= set(AGREES)


def test_table_has_a_column_for_each_set() -> None:
    other = replace(STUDY, design=replace(STUDY.design, weave=plain_weave("paper-table").weave))
    table = claims_table([STUDY, other])
    assert table is not None
    assert table.columns == ("paper-code", "paper-table")
    assert [row.claim for row in table.rows] == list(CLAIMS)
    alike = claims_table([STUDY, replace(STUDY, design=replace(STUDY.design, name="finer"))])
    assert alike is not None
    assert alike.columns == ("paper-code: made-up weave", "paper-code: finer")
    assert claims_table([replace(STUDY, records=())]) is None


def test_reasons_stand_where_something_else_is_found() -> None:
    table = claims_table([STUDY])
    assert table is not None
    for row in table.rows:
        assert bool(row.reason) == (row.findings[0].agrees in ("partly", "no") and bool(row.claim.reason))
    assert sum(int(part.split(": ")[1]) for part in table.tally[0].split(", ")) == len(CLAIMS)
