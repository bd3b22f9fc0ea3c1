"""Do the fibrils of a finished study still cross as its draft says? Reads results.h5 with h5py and NumPy only.

usage: check_weave.py RESULTS.h5
One line for each recorded state: fibril crossings found, how many of them on the wrong side, and how deep any two
centre lines of different yarns come within R + R'. Exit status 1 where a crossing is on the wrong side.
"""

import sys

import h5py
import numpy as np

SUB = 16  # chords of an element in these checks


def crossings(p, q):
    """z of p minus z of q wherever the plan views of the polylines p (m, 3) and q (n, 3) cross."""
    a, b = p[:-1, None], np.diff(p, axis=0)[:, None]
    c, d = q[None, :-1], np.diff(q, axis=0)[None]
    det = b[..., 0] * d[..., 1] - b[..., 1] * d[..., 0]
    det = np.where(det == 0.0, np.nan, det)
    e = c - a
    t = (e[..., 0] * d[..., 1] - e[..., 1] * d[..., 0]) / det
    s = (e[..., 0] * b[..., 1] - e[..., 1] * b[..., 0]) / det
    hit = (t >= 0) & (t < 1) & (s >= 0) & (s < 1)
    return ((a + t[..., None] * b) - (c + s[..., None] * d))[..., 2][hit], (a + t[..., None] * b)[hit]


def main(path):
    wrong_anywhere = 0
    with h5py.File(path) as f:
        mesh, draft = f["mesh"], f["design/weave/draft"]
        draft = np.array([draft[k][()] for k in sorted(draft)])
        first, radius = mesh["first_node"][()], mesh["radius"][()]
        yarn, axis = mesh["yarn"][()], mesh["yarn_axis"][()]
        n_warp = int((axis == 0).sum())
        for k in sorted(f["states"], key=lambda name: f["states"][name].attrs["@number"]):
            record = f["states"][k]
            r = record["configuration/x"][:, 0]
            lines = [r[first[i] : first[i + 1]] for i in range(len(first) - 1)]
            found = wrong = 0
            for i in np.flatnonzero(axis[yarn] == 0):
                for j in np.flatnonzero(axis[yarn] == 1):
                    dz, _ = crossings(lines[i], lines[j])
                    over = draft[yarn[i], yarn[j] - n_warp] == 1
                    found += len(dz)
                    wrong += int(np.sum((dz > 0) != over)) if len(dz) == 1 else len(dz)
            c = record["contacts"]
            overlap = -c["gap"][()] / (radius[c["fibril_a"][()]] + radius[c["fibril_b"][()]])
            wrong_anywhere += wrong
            sides = f"{found} crossings, {wrong} on the wrong side"
            print(f"{record.attrs['name']}: {sides}, overlap up to {overlap.max(initial=0):.2f} of R + R'")
    return 1 if wrong_anywhere else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
