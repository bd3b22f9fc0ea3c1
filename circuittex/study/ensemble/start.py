"""Where the first relaxations of the members of an ensemble start."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from circuittex.base.errors import DesignError
from circuittex.base.frozen import frozen
from circuittex.design import Design
from circuittex.geometry.weave import build_mesh
from circuittex.results.records import INITIAL
from circuittex.results.store import RESULTS, load_study
from circuittex.study.ensemble.files import STATE, head, member_folder
from circuittex.study.ensemble.perturbation import member_design
from circuittex.study.start import TILED, place, stored


@frozen
class MemberStarts:
    """The starts of some members of an ensemble."""

    words: str
    """What is recorded of them."""
    source: str
    """Folder of the ensemble that they start from, as every worker must see it; empty for the initial weaves."""
    state: str
    """The state that they start from."""
    members: frozenset[int]
    """Numbers of the members that have that state there; the others start from their initial weave."""

    def of(self, number: int) -> str:
        """The `start` of a member's run.

        >>> MemberStarts("initial", "", "", frozenset()).of(3)
        'initial'
        """
        return f"{member_folder(Path(self.source), number)}:{self.state}" if number in self.members else INITIAL


def member_starts(base: Design, wanted: str, numbers: Iterable[int]) -> MemberStarts:
    """The starts that `wanted` names of the members `numbers` of the ensemble of `base`: 'initial', or FOLDER[:STATE].

    FOLDER has an ensemble of a similar design with the same packings, each member of which starts from the state of its
    own number there. One state for all would be no random start, and no cell repeats in a random packing.

    Raises `DesignError` where these are no starts, in one sentence and before any work, and `StoreError` where the
    results of a member there cannot be read.
    """
    if not isinstance(wanted, str) or wanted == TILED:
        allowed = "no cell repeats in a random packing" if wanted == TILED else "it must be 'initial' or FOLDER[:STATE]"
        raise DesignError("start", wanted, f"{allowed}; members start from 'initial' or from another ensemble's")
    if wanted == INITIAL:
        return MemberStarts(INITIAL, "", "", frozenset())
    folder, state = place(wanted)
    there = _head(folder, wanted)
    if there["packing"] != head(base)["packing"]:
        raise DesignError("start", wanted, "its packings must be those of this ensemble: the same seed and amplitudes")
    source = folder.absolute()
    members = frozenset(number for number in numbers if _has(member_folder(source, number), state))
    if not members:
        raise DesignError("start", wanted, f"none of these members has a state {state!r} there")
    words = f"members' state {state} of {there['design']!r}, design {there['design_hash']}"
    starts = MemberStarts(words, str(source), state, members)
    _check(base, starts)
    return starts


def _head(folder: Path, wanted: str) -> dict[str, object]:
    """What the file of an ensemble says of it."""
    try:
        found = json.loads((folder / STATE).read_text(encoding="utf-8"))
        return {key: found[key] for key in ("packing", "design", "design_hash")}
    except (OSError, ValueError, KeyError, TypeError) as error:
        allowed = (
            "it must be the folder of an ensemble, so that each member starts from its own state there: from one state "
            "all would find equilibria near that one"
        )
        raise DesignError("start", wanted, allowed) from error


def _has(folder: Path, state: str) -> bool:
    """Whether a member has recorded a state. Raises `StoreError` where its file cannot be read."""
    return (folder / RESULTS).exists() and any(record.name == state for record in load_study(folder).records)


def _check(base: Design, starts: MemberStarts) -> None:
    """Refuse what no member can start from, by the first that can be laid out; a member that alone cannot says so."""
    for number in sorted(starts.members):
        design = member_design(base, number)
        try:
            mesh = build_mesh(design)
        except DesignError:  # its fibrils start inside one another, from wherever it is to be relaxed
            continue
        stored(mesh, design, starts.of(number))
        return
