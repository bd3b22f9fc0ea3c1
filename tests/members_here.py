"""Members of an ensemble computed in the process of the tests, without Dask."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

import circuittex.study.ensemble.run as run_module


def compute_here(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Members are computed in this process, one after another; returns the folders that were computed."""
    computed: list[str] = []

    def each(
        _: object, task: Callable[..., Any], arguments: Mapping[int, tuple[Any, ...]]
    ) -> Iterator[tuple[int, Any]]:
        for number, values in reversed(arguments.items()):  # members may finish in any order
            computed.append(Path(values[1]).name)
            try:
                yield number, task(*values)
            except Exception as error:
                yield number, error

    monkeypatch.setattr(run_module, "local_client", lambda _: contextlib.nullcontext())
    monkeypatch.setattr(run_module, "each_result", each)
    monkeypatch.setattr("circuittex.study.folder.write_report", lambda folder, study: folder)
    return computed
