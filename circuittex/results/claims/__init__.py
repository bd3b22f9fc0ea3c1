"""What the paper states, claim by claim, and what a study of its cell finds."""

from __future__ import annotations

from circuittex.results.claims import currents, mechanics, network
from circuittex.results.claims.cell import PaperStudy, paper_study, parameter_set
from circuittex.results.claims.claim import AGREES, Claim, Finding, Verdict
from circuittex.results.records import Study

CLAIMS: tuple[Claim, ...] = mechanics.CLAIMS + currents.CLAIMS + network.CLAIMS
"""All claims that a study can check."""


def judge(study: Study) -> tuple[Verdict, ...]:
    """What the study finds on each of `CLAIMS`; nothing where it is not of the paper's cell or has no states."""
    paper = paper_study(study)
    if paper is None:
        return ()
    missing = Finding("this study lacks a loading or a probe that it needs", "open")
    return tuple(Verdict(claim, claim.find(paper) or missing) for claim in CLAIMS)


__all__ = ["AGREES", "CLAIMS", "Claim", "Finding", "PaperStudy", "Verdict", "judge", "paper_study", "parameter_set"]
