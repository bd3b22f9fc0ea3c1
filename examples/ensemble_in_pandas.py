"""
An ensemble of packings, read into pandas
=========================================

Fibrils never lie quite as drawn. An ensemble computes many random packings of one design; its table is plain CSV.
"""

import tempfile
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd

import circuittex as ct


def main() -> None:
    """Dask's workers import this file: what it does stands in a function."""
    design = ct.plain_weave("paper-code", yarns=2, rows=(1,), loading=(ct.uniaxial("stretch", (0.02, 0.04)),))
    design = replace(design, packing=ct.Packing(lateral=0.01, vertical=0.01))
    with tempfile.TemporaryDirectory() as folder:
        ct.run_ensemble(design, folder, members=4)
        table = pd.read_csv(Path(folder) / "ensemble.csv")
    bands = table[table["quantity"] == "current_parallel"].set_index("strain").sort_index()
    print(bands[["unit", "p5", "median", "p95", "members"]])
    _, axes = plt.subplots(layout="constrained")
    axes.fill_between(bands.index, bands["p5"], bands["p95"], alpha=0.3, label="p5 to p95 of four packings")
    axes.plot(bands.index, bands["median"], "o-", label="median")
    axes.set(xlabel="stretch along x", ylabel="current to the parallel yarn at 1 V, A")
    axes.legend()


if __name__ == "__main__":
    main()
