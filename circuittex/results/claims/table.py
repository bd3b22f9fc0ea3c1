"""The table of claims: one row for each, one column for each study."""

from __future__ import annotations

from collections.abc import Sequence

from circuittex.base.frozen import frozen
from circuittex.results.claims import judge, parameter_set
from circuittex.results.claims.claim import AGREES, Claim, Finding
from circuittex.results.records import Study


@frozen
class Row:
    """A claim and what each study finds on it."""

    claim: Claim
    findings: tuple[Finding, ...]
    """One for each column."""

    @property
    def reason(self) -> str:
        """Why a study finds something else, where one does and a reason is known."""
        return self.claim.reason if any(finding.agrees in ("partly", "no") for finding in self.findings) else ""


@frozen
class Table:
    """All claims beside what the studies find."""

    columns: tuple[str, ...]
    """Parameter set of each study, with the design's name where two have the same."""
    rows: tuple[Row, ...]

    @property
    def tally(self) -> tuple[str, ...]:
        """For each column how many claims have which answer, such as '17 agrees, 2 in part'."""
        columns = zip(*(row.findings for row in self.rows), strict=True)
        answers = [[finding.agrees for finding in findings] for findings in columns]
        return tuple(
            ", ".join(f"{AGREES[key]}: {column.count(key)}" for key in AGREES if key in column) for column in answers
        )


def claims_table(studies: Sequence[Study]) -> Table | None:
    """The claims for the `studies` that are of the paper's cell; None where none is."""
    judged = [(study, verdicts) for study in studies if (verdicts := judge(study))]
    if not judged:
        return None
    sets = [str(parameter_set(study.design)) for study, _ in judged]
    columns = [
        name if sets.count(name) == 1 else f"{name}: {study.design.name}"
        for name, (study, _) in zip(sets, judged, strict=True)
    ]
    rows = zip(*(verdicts for _, verdicts in judged), strict=True)
    return Table(
        tuple(columns),
        tuple(Row(row[0].claim, tuple(verdict.finding for verdict in row)) for row in rows),
    )
