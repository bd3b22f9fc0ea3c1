"""Is every crossing on the side that the draft says, and how deep do fibrils overlap?

    python tests/check_crossings.py results.h5 [LIMIT]

Uses the centre lines and the draft in the file alone, and nothing of circuittex. Exit code 1 where a crossing is on the
wrong side, or where an overlap R + R' - d exceeds LIMIT (1 unless given) of the smaller radius.
"""

import sys
from itertools import pairwise

import h5py
import numpy as np
from plan_view import side
from scipy.interpolate import CubicSpline
from scipy.spatial.distance import cdist

SAMPLES = 241


def distance(p, q):  # smallest distance of two short polylines
    best = np.inf
    for a, b in pairwise(p):
        for c, d in pairwise(q):
            u, v, w, s, t = b - a, d - c, a - c, 0.5, 0.5
            for _ in range(40):  # alternating projection onto either segment
                s = min(1.0, max(0.0, -(w - t * v) @ u / (u @ u)))
                t = min(1.0, max(0.0, (w + s * u) @ v / (v @ v)))
            best = min(best, float(np.linalg.norm(w + s * u - t * v)))
    return best


def examine(r, first, yarn, radius, draft):
    """Fibril crossings on the wrong side, all, yarn crossings with a wrong one, and the deepest overlap over R."""
    u = np.linspace(0, 1, SAMPLES)
    lines = [CubicSpline(np.linspace(0, 1, b - a), r[a:b])(u) for a, b in pairwise(first)]
    n_warp, wrong, total, where, deepest = len(draft), 0, 0, set(), 0.0
    for f in range(len(lines)):
        for g in range(f + 1, len(lines)):
            gap = cdist(lines[f], lines[g])
            i, j = np.unravel_index(np.argmin(gap), gap.shape)
            if gap[i, j] < radius[f] + radius[g]:
                near = [line[max(0, k - 2) : k + 3] for line, k in ((lines[f], i), (lines[g], j))]
                deepest = max(deepest, (radius[f] + radius[g] - distance(*near)) / min(radius[f], radius[g]))
            if yarn[f] < n_warp <= yarn[g]:
                total += 1
                if side(lines[f], lines[g]) != draft[yarn[f], yarn[g] - n_warp]:
                    wrong += 1
                    where.add((int(yarn[f]) + 1, int(yarn[g]) - n_warp + 1))
    return wrong, total, sorted(where), deepest


def main(path, limit=1.0):
    bad = False
    with h5py.File(path, "r", locking=False) as h5:
        mesh, rows = h5["mesh"], h5["design/weave/draft"]
        draft = np.array([rows[k][()] for k in sorted(rows)])
        for key in sorted(h5["states"], key=lambda name: h5["states"][name].attrs["@number"]):
            record = h5["states"][key]
            r = record["configuration/x"][()][:, 0]
            table = (mesh[k][()] for k in ("first_node", "yarn", "radius"))
            wrong, total, where, deepest = examine(r, *table, draft)
            print(
                f"{record.attrs['name']}: {wrong} of {total} fibril crossings on the wrong side, in {len(where)} of "
                f"{draft.size} yarn crossings {where}; deepest overlap {deepest:.2f} R"
            )
            bad |= wrong > 0 or deepest > limit
    return int(bad)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], *map(float, sys.argv[2:])))
