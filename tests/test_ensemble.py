"""Ensembles: percentiles, seeds, members that fail, resumption, and what is left in the folder.

Members are computed in this process, most of them by a stand-in; `test_ensemble_cluster` has them on Dask.
"""

from __future__ import annotations

import csv
import json
import warnings
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from members_here import compute_here

import circuittex.study.ensemble.run as run_module
from circuittex.base.errors import CircuittexWarning, ConvergenceError, DesignError, FolderError
from circuittex.command.cli import main
from circuittex.command.exit_codes import ExitCode
from circuittex.design import Design, design_hash, load_design, plain_weave, starter, uniaxial
from circuittex.design.packing import Packing
from circuittex.geometry import build_mesh
from circuittex.geometry.centre_lines import centre_lines
from circuittex.geometry.overlap import check_overlaps
from circuittex.results.store import load_study
from circuittex.study.ensemble import Ensemble, percentiles, run_ensemble
from circuittex.study.ensemble.figures import band_figures
from circuittex.study.ensemble.files import COLUMNS, content, table
from circuittex.study.ensemble.member import FILE, Outcome, compute_member, plain, read_outcome, write_outcome
from circuittex.study.ensemble.page import page
from circuittex.study.ensemble.perturbation import default_packing, member_design, member_seed, perturbed
from circuittex.study.ensemble.quantities import quantities
from circuittex.study.ensemble.result import BANDS
from circuittex.study.ensemble.run import assembled
from circuittex.study.plan import plan
from circuittex.study.run import run_study

TINY = plain_weave(yarns=2, rows=(1,))
TINY = replace(TINY, numerics=replace(TINY.numerics, elements=3))
STRETCHED = replace(TINY, loading=(uniaxial("stretch", (0.02,)), uniaxial("back", (0.02, -0.01, 0.03))))


# ---- percentiles ------------------------------------------------------------------------------------------


def test_percentiles_of_known_values() -> None:
    """Of 0, 1, ..., 20 the percentile p is p / 5."""
    values = np.random.default_rng(0).permutation(21.0 * np.arange(21) / 21)
    np.testing.assert_allclose(percentiles(values, (0, 5, 25, 50, 95, 100)), [0, 1, 5, 10, 19, 20], rtol=1e-15)


finite = st.floats(-1e6, 1e6)


@given(arrays(np.float64, st.tuples(st.integers(1, 9), st.integers(1, 3)), elements=st.one_of(finite, st.just(np.nan))))
def test_percentiles_are_those_of_numpy_without_the_missing_values(values: np.ndarray) -> None:
    found = percentiles(values, BANDS)
    for column in range(values.shape[1]):
        present = values[~np.isnan(values[:, column]), column]
        if len(present):
            np.testing.assert_allclose(found[:, column], np.percentile(present, BANDS), rtol=1e-13, atol=1e-9)
        else:
            assert np.isnan(found[:, column]).all()


def test_infinite_resistances_are_values() -> None:
    values = np.array([1.0, np.inf, np.inf, 2.0, np.inf])
    assert percentiles(values, (0, 25, 50, 100)).tolist() == [1.0, 2.0, np.inf, np.inf]
    assert percentiles(np.array([1.0, np.inf]), (50,)).tolist() == [np.inf]


# ---- seeds and amplitudes ---------------------------------------------------------------------------------


def test_seeds_are_distinct_repeatable_and_fit_into_any_number() -> None:
    seeds = [member_seed(seed, number) for seed in (0, 1) for number in range(500)]
    assert len(set(seeds)) == 1000
    assert seeds == [member_seed(seed, number) for seed in (0, 1) for number in range(500)]
    assert max(seeds) < 2**53
    assert [float(seed) == seed for seed in seeds]


def test_the_seeds_of_today_are_those_of_tomorrow() -> None:
    """NumPy guarantees its SeedSequence; reported seeds must keep their meaning."""
    assert [member_seed(0, 0), member_seed(0, 1)] == [4232842298785526, 2383740928328724]


def test_amplitudes_are_those_of_the_design_or_small_ones() -> None:
    assert perturbed(TINY).packing.lateral == pytest.approx(0.05 * 0.15)
    stated = replace(TINY, packing=Packing(seed=3, phase=0.02))
    assert (perturbed(stated).packing.lateral, perturbed(stated).packing.phase, perturbed(stated).packing.seed) == (
        0.0,
        0.02,
        3,
    )
    assert perturbed(stated, 8).packing.seed == 8
    member = member_design(perturbed(stated, 8), 2)
    assert (member.packing.phase, member.packing.seed) == (0.02, member_seed(8, 2))


def test_each_default_moves_fibrils_by_five_per_cent_of_their_radius() -> None:
    """Root mean square over many seeds: everywhere for offsets, at the far ends of the outer fibrils for the twist."""
    weave = plain_weave(yarns=2).weave
    regular = centre_lines(weave, 5).position
    default = default_packing(weave)
    for key, axis in (("lateral", 1), ("vertical", 2)):
        only = [centre_lines(weave, 5, Packing(seed=n, **{key: getattr(default, key)})).position for n in range(40)]
        size = np.sqrt(np.mean((np.array(only) - regular)[:, :20, :, axis] ** 2))
        assert size == pytest.approx(0.0075, rel=0.1)  # 800 fibrils, five places each
    turned = [centre_lines(weave, 5, Packing(seed=n, twist=default.twist)).position for n in range(400)]
    moved = np.linalg.norm(np.array(turned) - regular, axis=-1)[:, :, -1].max(axis=1)  # the largest of four yarns
    normal = np.abs(np.random.default_rng(0).standard_normal((4000, 4))).max(axis=1)
    assert moved.mean() / 0.0075 == pytest.approx(normal.mean(), rel=0.1)
    assert default_packing(plain_weave(rows=(1,)).weave).twist == 0.0


# ---- members in this process ------------------------------------------------------------------------------


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    return compute_here(monkeypatch)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Instead of its physics, the numbers of a member are drawn from its seed; its packing is laid out all the same."""

    def draw_study(design: Design, folder: Path, *, start: str, workers: int) -> Any:
        if design.numerics.max_iterations == 1:
            return run_study(design, folder, workers=workers)  # which does not converge
        build_mesh(design)
        rng = np.random.default_rng(design.packing.seed)
        records = [
            SimpleNamespace(
                name=step.name,
                clamp_force=rng.standard_normal((2, 3)),
                currents=tuple(rng.random(len(design.probes))),
                fields=design.probes,
                outcome=SimpleNamespace(network=tuple(rng.random(2))),
                verification=SimpleNamespace(routes=()),
            )
            for step in plan(design)
        ]
        return SimpleNamespace(records=records)

    monkeypatch.setattr("circuittex.study.ensemble.member.run_study", draw_study)
    monkeypatch.setattr("circuittex.study.ensemble.files.save_bands", lambda ensemble, folder: {})


def test_members_are_studies_of_their_own_seeds(here: list[str], tmp_path: Path) -> None:
    """Every value is in the results of the member's own design, and the spread is real."""
    said: list[str] = []
    ensemble = run_ensemble(TINY, tmp_path / "e", members=2, seed=5, progress=said.append)
    assert here == ["0001", "0000"]
    assert any("2 of 2 members, 0 failed" in text for text in said)
    assert ensemble.states == ("relaxed",)
    assert ensemble.seeds == tuple(member_seed(5, number) for number in range(2))
    alone = replace(TINY, packing=replace(default_packing(TINY.weave), seed=ensemble.seeds[1]))
    study = load_study(tmp_path / "e" / "members" / "0001" / "results.h5")
    assert study.design_hash == design_hash(alone)
    (record,) = study.records
    expected = [*record.clamp_force.ravel(), *record.currents, record.fit.Ry, record.fit.Rc]
    assert ensemble.values[1, 0].tolist() == expected
    # offsets of 5 % of a radius change the tension of single fibrils by some per cent
    assert (np.ptp(ensemble.values[:, :, 0], axis=0) > 1e-5).all()
    assert sorted(path.name for path in (tmp_path / "e" / "figures").glob("*.png")) == [
        "currents.png",
        "forces.png",
        "network.png",
    ]


@pytest.mark.usefixtures("quick")
def test_an_ensemble_goes_on_and_grows_without_computing_anything_twice(here: list[str], tmp_path: Path) -> None:
    first = run_ensemble(STRETCHED, tmp_path, members=2)
    assert first.states == ("relaxed", "stretch-0.02", "back-0.02", "back--0.01", "back-0.03")
    assert first.strains.tolist() == [0.0, 0.02, 0.02, -0.01, 0.03]
    kept = (tmp_path / "ensemble.csv").read_bytes()
    (tmp_path / "ensemble.csv").unlink()
    again = run_ensemble(STRETCHED, tmp_path, members=2)
    assert here == ["0001", "0000"]
    assert np.array_equal(first.values, again.values)
    assert (tmp_path / "ensemble.csv").read_bytes() == kept
    more = run_ensemble(STRETCHED, tmp_path, members=3)
    assert here == ["0001", "0000", "0002"]
    assert np.array_equal(more.values[:2], first.values)
    fewer = run_ensemble(STRETCHED, tmp_path, members=1)
    assert np.array_equal(fewer.values, first.values[:1])


@pytest.mark.usefixtures("quick")
def test_a_member_that_cannot_be_packed_is_reported_with_its_seed(here: list[str], tmp_path: Path) -> None:
    """At a large amplitude some packings overlap: which ones, the geometry alone says."""
    crowded = replace(plain_weave(yarns=2, rows=(2,)), packing=Packing(seed=1, lateral=0.075))
    crowded = replace(crowded, numerics=TINY.numerics)
    expected = []
    for number in range(4):
        try:
            check_overlaps(crowded.weave, member_design(crowded, number).packing)
            expected.append(True)
        except DesignError:
            expected.append(False)
    assert len(set(expected)) == 2
    ensemble = run_ensemble(crowded, tmp_path, members=4)
    assert [not failure for failure in ensemble.failures] == expected
    bad = expected.index(False)
    assert f"packing.seed: {ensemble.seeds[bad]} is not usable" in ensemble.failures[bad]
    assert np.isnan(ensemble.values[bad]).all()
    assert np.isfinite(ensemble.values[expected.index(True)]).all()
    assert ensemble.finished == sum(expected)
    assert (ensemble.count == sum(expected)).all()
    here.clear()
    assert run_ensemble(crowded, tmp_path, members=4).failures == ensemble.failures
    assert here == []  # another attempt would end in the same way


@pytest.mark.usefixtures("here", "quick")
def test_a_member_that_does_not_converge_is_reported_with_its_seed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One of two members may take a single iteration."""

    def hasty(design: Design, number: int) -> Design:
        member = member_design(design, number)
        return member if number else replace(member, numerics=replace(member.numerics, max_iterations=1))

    monkeypatch.setattr(run_module, "member_design", hasty)
    ensemble = run_ensemble(TINY, tmp_path, members=2)
    assert ensemble.failures[1] == ""
    assert "iteration" in ensemble.failures[0]
    assert np.isnan(ensemble.values[0]).all()
    assert np.isfinite(ensemble.values[1]).all()
    assert ensemble.count.tolist() == [[1] * 11]
    text = (tmp_path / "ensemble.html").read_text(encoding="utf-8")
    assert "1 of 2 members have all their states" in text
    assert str(ensemble.seeds[0]) in text
    assert json.loads((tmp_path / "members" / "0000" / FILE).read_text())["failure"] == ensemble.failures[0]


def test_states_before_a_failure_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A study that gives up after its relaxed state leaves that state in the ensemble."""

    def gives_up(design: Design, folder: Path, **options: object) -> None:
        run_study(replace(design, loading=()), folder, workers=1)
        raise ConvergenceError("no equilibrium\nwas found")

    monkeypatch.setattr("circuittex.study.folder.write_report", lambda folder, study: folder)
    monkeypatch.setattr("circuittex.study.ensemble.member.run_study", gives_up)
    outcome = compute_member(member_design(perturbed(STRETCHED), 0), str(tmp_path / "0000"))
    assert outcome.failure == "no equilibrium was found"
    assert np.isfinite(outcome.values[0]).all()
    assert np.isnan(outcome.values[1:]).all()


@pytest.mark.usefixtures("here", "quick")
def test_an_error_that_is_no_property_of_the_design_is_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(
            "circuittex.study.ensemble.member.run_study", lambda *_, **__: (_ for _ in ()).throw(OSError("disk full"))
        )
        ensemble = run_ensemble(TINY, tmp_path, members=2)
    assert ensemble.failures == ("OSError: disk full",) * 2
    assert np.isnan(ensemble.values).all()
    assert run_ensemble(TINY, tmp_path, members=2).failures == ("", "")


@pytest.mark.usefixtures("quick")
def test_an_interrupt_leaves_the_finished_members(here: list[str], tmp_path: Path) -> None:
    def interrupt(text: str) -> None:
        if text.startswith("1 of 2"):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_ensemble(TINY, tmp_path, members=2, progress=interrupt)
    assert here == ["0001"]
    assert run_ensemble(TINY, tmp_path, members=2).failures == ("", "")
    assert here == ["0001", "0000"]


# ---- folder -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("change", ["seed", "amplitude", "design", "version"])
def test_another_ensemble_is_not_mixed_with_what_is_there(
    here: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: str
) -> None:
    run_module.open_folder(tmp_path, perturbed(TINY))
    design = TINY
    if change == "amplitude":
        design = replace(TINY, packing=Packing(phase=0.01))
    elif change == "design":
        design = replace(TINY, name="another")
    elif change == "version":
        monkeypatch.setattr("circuittex.study.ensemble.files.__version__", "99.0")
    with pytest.raises(FolderError, match="another version" if change == "version" else "another design hash"):
        run_ensemble(design, tmp_path, members=1, seed=1 if change == "seed" else None)
    assert here == []


def test_a_folder_that_cannot_be_gone_on_with_is_refused(here: list[str], tmp_path: Path) -> None:
    (tmp_path / "members" / "0000").mkdir(parents=True)
    with pytest.raises(FolderError, match=r"members of an ensemble but no ensemble\.json"):
        run_ensemble(TINY, tmp_path, members=1)
    (tmp_path / "ensemble.json").write_text("[]", encoding="utf-8")
    with pytest.raises(FolderError, match="cannot be read"):
        run_ensemble(TINY, tmp_path, members=1)


def test_bad_arguments_are_refused_before_any_work(here: list[str], tmp_path: Path) -> None:
    with pytest.raises(DesignError, match=r"^members: 0 is not usable"):
        run_ensemble(TINY, tmp_path / "e", members=0)
    with pytest.raises(DesignError, match=r"^workers: 0 is not usable"):
        run_ensemble(TINY, tmp_path / "e", members=1, workers=0)
    with pytest.raises(DesignError, match=r"^packing\.seed: -1 is not usable"):
        run_ensemble(TINY, tmp_path / "e", members=1, seed=-1)
    assert not (tmp_path / "e").exists()


def test_outcomes_survive_their_file_and_others_are_not_taken(tmp_path: Path) -> None:
    design = member_design(perturbed(STRETCHED), 0)
    values = np.random.default_rng(0).standard_normal((5, len(quantities(design))))
    values[0, :3] = np.nan, np.inf, -np.inf
    assert read_outcome(tmp_path, design) is None
    write_outcome(tmp_path, design, Outcome(values, "why", ("relaxed",)))
    found = read_outcome(tmp_path, design)
    assert found is not None
    assert np.array_equal(found.values, values, equal_nan=True)
    assert (found.failure, found.disagreeing) == ("why", ("relaxed",))
    assert read_outcome(tmp_path, member_design(perturbed(STRETCHED), 1)) is None
    (tmp_path / FILE).write_text("{}", encoding="utf-8")
    assert read_outcome(tmp_path, design) is None


# ---- table, JSON, figures, page ---------------------------------------------------------------------------


@pytest.fixture(scope="module")
def made_up() -> Ensemble:
    """Twenty members of a design with two paths, one of them back and forth; two failed, one on the way."""
    design = replace(STRETCHED, name="<made> & up")
    rng = np.random.default_rng(1)
    shape = (5, len(quantities(design)))
    outcomes = [Outcome(1.0 + 0.1 * rng.standard_normal(shape), "", ()) for _ in range(18)]
    some = np.full(shape, np.nan)
    some[0] = 1.0
    outcomes.append(Outcome(some, "gave up <here>", ()))
    outcomes.append(Outcome(np.full(shape, np.nan), "overlap", ()))
    outcomes[3] = replace(outcomes[3], values=np.where(np.arange(shape[1]) == shape[1] - 1, np.inf, outcomes[3].values))
    return assembled(perturbed(design), outcomes)


def test_the_table_holds_the_percentiles(made_up: Ensemble) -> None:
    rows = list(csv.DictReader(table(made_up).splitlines()))
    assert tuple(rows[0]) == COLUMNS
    assert len(rows) == 5 * 11
    for row in rows:
        state = made_up.states.index(row["state"])
        column = [quantity.name for quantity in made_up.quantities].index(row["quantity"])
        values = made_up.values[:, state, column]
        values = values[~np.isnan(values)]
        assert int(row["members"]) == len(values) == (19 if state == 0 else 18)
        if np.isfinite(values).all():
            wanted = np.percentile(values, [50, 5, 25, 75, 95])
            np.testing.assert_allclose([float(row[k]) for k in COLUMNS[5:10]], wanted, rtol=1e-14)
        assert float(row["strain"]) == made_up.strains[state]
    assert {row["unit"] for row in rows} == {"N", "A", "ohm"}


def test_the_json_is_strict_and_complete(made_up: Ensemble) -> None:
    text = json.dumps(content(made_up), allow_nan=False)
    found = json.loads(text)
    assert found["packing"]["lateral_mm"] == made_up.design.packing.lateral
    assert found["quantities"][-1] == "Rc_ohm"
    assert [member["seed"] for member in found["members"]] == list(made_up.seeds)
    assert found["members"][19]["failure"] == "overlap"
    assert found["members"][19]["values"][0][0] is None
    assert found["members"][3]["values"][0][-1] == "inf"
    assert found["members"][0]["values"] == plain(made_up.values[0])
    assert found["states"][1]["count"][0] == 18
    assert found["states"][2]["percentiles"]["p50"] == plain(percentiles(made_up.values, [50])[0, 2])


def test_the_figures_show_the_bands_where_they_are(made_up: Ensemble) -> None:
    figures = band_figures(made_up)
    assert list(figures) == ["forces", "currents", "network"]
    assert [len(figure.axes) for figure in figures.values()] == [4, 6, 4]
    axes = figures["network"].axes[0]  # Ry along the first path
    column = len(made_up.quantities) - 2
    median = axes.lines[-2]  # the last is the insulated value
    np.testing.assert_allclose(
        median.get_ydata(), np.nanpercentile(made_up.values[:, :2, column], 50, axis=0), rtol=1e-14
    )
    assert median.get_xdata().tolist() == [0.0, 0.02]  # type: ignore[union-attr]
    wide, narrow = (np.vstack([path.vertices for path in c.get_paths()]) for c in axes.collections)
    for found, ends in ((wide, (5, 95)), (narrow, (25, 75))):
        expected = np.nanpercentile(made_up.values[:, :2, column], ends, axis=0)
        assert (found[:, 1].min(), found[:, 1].max()) == pytest.approx(
            (expected[0].min(), expected[1].max()), rel=1e-14
        )
    assert axes.lines[-1].get_ydata()[0] == pytest.approx(
        0.2829 * 10, rel=2e-4
    )  # [57], with one fibril in place of ten
    back = figures["network"].axes[2]
    assert len(back.collections) == 6  # forth, back and forth again, two bands each
    for figure in figures.values():
        assert all(axes.get_xlabel() and axes.get_ylabel() for axes in figure.axes)


def test_a_single_state_and_unreached_quantities_can_be_drawn() -> None:
    design = perturbed(replace(TINY, loading=()))
    values = np.full((1, len(quantities(design))), 1.0)
    values[0, -1] = np.inf
    figures = band_figures(assembled(design, [Outcome(values, "", ())] * 3))
    assert "infinite" in figures["network"].axes[1].texts[0].get_text()
    no_probes = replace(design, probes=(), terminals=())
    forces = Outcome(np.ones((1, 6)), "", ())
    assert list(band_figures(assembled(no_probes, [forces]))) == ["forces"]


def test_the_page_holds_itself_and_names_failures(made_up: Ensemble) -> None:
    text = page(made_up, {"forces": b"PNG"})
    assert "18 of 20 members have all their states" in text
    assert "&lt;made&gt; &amp; up" in text
    assert "<made>" not in text
    assert "gave up &lt;here&gt;" in text
    assert "data:image/png;base64,UE5H" in text
    assert 'src="http' not in text
    assert "border-collapse" in text  # the look of the report came along
    assert str(made_up.seeds[19]) in text
    doubtful = replace(made_up, disagreeing=(("relaxed",), *made_up.disagreeing[1:]))
    assert "DISAGREE" in page(doubtful, {})
    assert "DISAGREE" not in text


# ---- the command ------------------------------------------------------------------------------------------


def run_command(monkeypatch: pytest.MonkeyPatch, ensemble: Ensemble, *words: str) -> tuple[int, dict[str, Any]]:
    """The exit code of `circuittex ensemble`, and the arguments that it hands on."""
    taken: dict[str, Any] = {}

    def stand_in(design: Design, out: Path, **options: Any) -> Ensemble:
        taken.update(options, design=design, out=out)
        return ensemble

    monkeypatch.setattr("circuittex.study.ensemble.command.run_ensemble", stand_in)
    return main(["ensemble", *words]), taken


def test_the_command_reports_bands_and_failures(
    made_up: Ensemble, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "weave.toml"
    file.write_text(starter(), encoding="utf-8")
    code, taken = run_command(monkeypatch, made_up, str(file), "--members", "20", "--seed", "4", "--workers", "2")
    assert code == ExitCode.PARTLY
    assert design_hash(taken["design"]) == design_hash(load_design(file))
    assert (taken["members"], taken["seed"], taken["workers"], taken["address"]) == (20, 4, 2, None)
    assert taken["out"] == Path("results", "weave-ensemble")
    out, err = capsys.readouterr()
    column = len(made_up.quantities) - 2
    median, low, high = np.nanpercentile(made_up.values[:, 1, column], (50, 5, 95))
    assert f"{median:.4g} [{low:.4g}, {high:.4g}]" in out
    assert "18 of 20 members have all their states" in out
    assert f"member 0018 (seed {made_up.seeds[18]}) is incomplete: gave up <here>" in err
    assert err.count("is incomplete") == 2


def test_the_command_warns_where_routes_disagree_even_if_quiet(
    made_up: Ensemble, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "weave.toml"
    file.write_text(starter(), encoding="utf-8")
    doubtful = replace(made_up, disagreeing=(("relaxed",), *made_up.disagreeing[1:]))
    words = [str(file), "--members", "20", "--out", str(tmp_path / "e"), "--scheduler", "tcp://node:8786", "--quiet"]
    code, taken = run_command(monkeypatch, doubtful, *words)
    assert code == ExitCode.DISAGREE
    assert (taken["address"], taken["out"]) == ("tcp://node:8786", tmp_path / "e")
    out, err = capsys.readouterr()
    assert out == ""
    assert "DISAGREE in relaxed" in err


def test_workers_and_a_scheduler_exclude_one_another(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["ensemble", "a.toml", "--members", "2", "--workers", "2", "--scheduler", "tcp://node:8786"])
    assert "not allowed with" in capsys.readouterr().err


def test_an_ensemble_whose_members_all_fail_is_no_success(
    made_up: Ensemble, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "weave.toml"
    file.write_text(starter(), encoding="utf-8")
    failed = replace(made_up, failures=("no equilibrium",) * 20, disagreeing=((),) * 20)
    nothing = replace(failed, values=np.full_like(made_up.values, np.nan))
    words = [str(file), "--members", "20", "--out", str(tmp_path / "e"), "--quiet"]
    # States that were found before a member failed are results, and are kept.
    for ensemble, expected in ((failed, ExitCode.PARTLY), (nothing, ExitCode.NO_EQUILIBRIUM)):
        code, _ = run_command(monkeypatch, ensemble, *words)
        assert code == expected
        assert "all 20 members failed" in capsys.readouterr().err


def test_what_a_member_notes_of_its_folder_has_been_said_of_the_ensembles(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A hundred members on a share without locks are a hundred locks that nobody holds, and one thing to say."""

    def noting(*_: object, **__: object) -> None:
        warnings.warn("its file system has no locks", CircuittexWarning, stacklevel=1)  # here warnings are errors
        raise ConvergenceError("no equilibrium")

    monkeypatch.setattr("circuittex.study.ensemble.member.run_study", noting)
    assert compute_member(perturbed(STRETCHED), str(tmp_path / "member")).failure == "no equilibrium"
