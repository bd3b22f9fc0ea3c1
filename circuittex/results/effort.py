"""What the equilibria of a study took: for the closing table and the report."""

from __future__ import annotations

from circuittex.results.records import INITIAL, Study


def effort(study: Study) -> tuple[str, ...]:
    """Sentences that say what the equilibria of the study took, and how good they are."""
    if not study.records:
        return ()
    iterations = [record.iterations for record in study.records]
    worst = max(study.records, key=lambda record: record.residual)
    states = "1 equilibrium" if len(iterations) == 1 else f"{len(iterations)} equilibria"
    sentences = [
        f"{states} in {sum(iterations)} iterations, at most {max(iterations)} for one; the largest free force "
        f"is {worst.residual:.1e} N in {worst.name} ({study.design.numerics.allowed} is allowed)."
    ]
    if study.start != INITIAL:
        sentences.append(f"The first relaxation did not start from the initial weave: {study.start}.")
    halved = [f"{record.name} in {record.parts} parts" for record in study.records if record.parts > 1]
    if halved:
        sentences.append(f"Increments too large to converge as a whole were halved: {', '.join(halved)}.")
    return tuple(sentences)
