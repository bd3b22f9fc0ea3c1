"""How far fibrils start inside one another and on which sides, and the refusal of designs where either is not right."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from circuittex.base.arrays import Floats, Ints
from circuittex.base.errors import DesignError
from circuittex.design import Weave, Yarn
from circuittex.design.packing import Packing
from circuittex.geometry.centre_lines import CentreLines, centre_lines
from circuittex.geometry.crossings import Lines, against_draft, woven

_SAMPLES = 16  # chords a crossing; in the paper's cell they leave the curve by 0.003 mm at the most
_CHUNK = 50_000  # chords searched at a time, which bounds the memory
_COUNTED = "(counted from 1, the lowest row first)"
_SLACK = 1e-5  # of the smallest radius: a start of exactly one radius is allowed whatever the rounding


def check_overlaps(weave: Weave, packing: Packing = Packing()) -> None:  # noqa: B008 (frozen)
    """Refuse a weave in which two fibrils start more than the smaller of their radii inside one another.

    The overlap is R + R' - d, d the smallest distance of the centre lines, sampled independently of the mesh.
    The `DesignError` names the deepest pair and the key of the design that moves the two apart: the seed of the
    `packing` where the regular one is allowed.

    >>> from circuittex.design import plain_weave
    >>> check_overlaps(plain_weave(yarns=2).weave)
    """
    if not packing.regular:
        check_overlaps(weave)
    lines = _sampled(weave, packing)
    radius = np.array([kind.radius for kind in weave.yarns])[lines.yarn]
    deepest, pair = 0.0, (0, 0)
    for first, second, distance in near_pairs(lines.position, float(radius.max())):
        # R + R' - d exceeds the smaller radius where d falls short of the larger one
        excess = np.maximum(radius[first], radius[second]) - distance
        worst = int(np.argmax(excess))
        if excess[worst] > deepest:
            deepest, pair = float(excess[worst]), (int(first[worst]), int(second[worst]))
    if deepest > _SLACK * float(radius.min()):
        raise _refusal(weave, packing, lines.yarn, min(pair), max(pair), deepest)


def check_starting_sides(weave: Weave, packing: Packing = Packing()) -> None:  # noqa: B008 (frozen)
    """Refuse a weave in which a warp and a weft fibril start on the wrong side of one another.

    Yarns of several rows can start so without being deep inside one another, row between row. The `DesignError` is
    about the amplitude, or about the seed of the `packing` where the regular one is allowed.

    >>> from circuittex.design import plain_weave
    >>> check_starting_sides(plain_weave(yarns=2).weave)
    """
    if not packing.regular:
        check_starting_sides(weave)
    lines = _sampled(weave, packing)
    n, samples = lines.position.shape[:2]
    axis = (lines.yarn >= len(weave.warp)).astype(np.int64)
    found = woven(Lines(lines.position.reshape(-1, 3), samples * np.arange(n + 1), axis))
    pairs, _ = against_draft(found, np.array(weave.draft), lines.yarn)
    if not len(pairs):
        return
    labels = [_label(weave, lines.yarn, fibril)[0] for fibril in pairs[0].tolist()]
    wrong = f"{labels[0]} and {labels[1]} {_COUNTED} start on the wrong side of one another"
    if not packing.regular:
        raise DesignError("packing.seed", packing.seed, wrong)
    apart = max(map(_height, weave.warp)) / 2 + max(map(_height, weave.weft)) / 2
    weft = weave.weft_amplitude
    least = apart / 2 if isinstance(weft, str) else max(0.0, apart - weft)
    raise DesignError("weave.amplitude", weave.amplitude, f"{wrong}; above {least:.4g} mm their rows are apart")


def segment_distance(p: Floats, q: Floats, r: Floats, s: Floats) -> Floats:
    """(n,) smallest distance of the segments from p to q and from r to s, each (n, 3).

    Either the lines come closest inside both segments, or an end of one is closest to the other.

    >>> x = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, -1.0, 2.0], [0.5, 1.0, 2.0]])[:, None]
    >>> segment_distance(*x)
    array([2.])
    """
    ends = [_point_distance(p, r, s), _point_distance(q, r, s), _point_distance(r, p, q), _point_distance(s, p, q)]
    u, v, w = q - p, s - r, p - r
    uu, uv, vv = _dot(u, u), _dot(u, v), _dot(v, v)
    uw, vw = _dot(u, w), _dot(v, w)
    determinant = uu * vv - uv**2
    skew = determinant > 1e-12 * uu * vv  # parallel segments are closest at an end
    safe = np.where(skew, determinant, 1.0)
    along, other = (uv * vw - vv * uw) / safe, (uu * vw - uv * uw) / safe
    inside = skew & (along >= 0.0) & (along <= 1.0) & (other >= 0.0) & (other <= 1.0)
    gap = np.linalg.norm(w + along[:, None] * u - other[:, None] * v, axis=1)
    return np.asarray(np.minimum.reduce([*ends, np.where(inside, gap, np.inf)]), dtype=np.float64)


def near_pairs(position: Floats, distance: float) -> Iterator[tuple[Ints, Ints, Floats]]:
    """Chunk by chunk, all chords of different fibrils at most `distance` apart: their fibrils and distance."""
    fibril = np.repeat(np.arange(len(position)), position.shape[1] - 1)
    p, q = position[:, :-1].reshape(-1, 3), position[:, 1:].reshape(-1, 3)
    middle = (p + q) / 2.0
    tree = cKDTree(middle)
    reach = distance + float(np.linalg.norm(q - p, axis=1).max())
    for start in range(0, len(p), _CHUNK):
        part = cKDTree(middle[start : start + _CHUNK])
        found = part.sparse_distance_matrix(tree, reach, output_type="ndarray")
        a, b = found["i"] + start, found["j"]
        once = fibril[a] < fibril[b]
        a, b = a[once], b[once]
        if len(a):
            yield fibril[a], fibril[b], segment_distance(p[a], q[a], p[b], q[b])


def _point_distance(x: Floats, p: Floats, q: Floats) -> Floats:
    """(n,) distance of points x from the segments from p to q."""
    along = q - p
    t = np.clip(_dot(x - p, along) / _dot(along, along), 0.0, 1.0)
    return np.asarray(np.linalg.norm(x - p - t[:, None] * along, axis=1), dtype=np.float64)


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.einsum("ij,ij->i", a, b), dtype=np.float64)


def _sampled(weave: Weave, packing: Packing) -> CentreLines:
    return centre_lines(weave, _SAMPLES * max(len(weave.warp), len(weave.weft)) + 1, packing)


def _height(yarn: Yarn) -> float:
    """Distance of the highest row from the lowest, mm."""
    return (len(yarn.rows) - 1) * yarn.row_spacing


def _label(weave: Weave, yarn: Ints, fibril: int) -> tuple[str, int]:
    """What a fibril is called, and its number in its yarn, from 0."""
    place = fibril - int(np.searchsorted(yarn, yarn[fibril]))
    return f"fibril {place + 1} of {weave.yarn_names[yarn[fibril]]}", place


def _refusal(weave: Weave, packing: Packing, yarn: Ints, f: int, g: int, excess: float) -> DesignError:
    """The error for fibrils f < g: its field is the key that holds the two apart."""
    labels, places = zip(*(_label(weave, yarn, fibril) for fibril in (f, g)), strict=True)
    first, second = weave.yarns[yarn[f]], weave.yarns[yarn[g]]
    allowed = min(first.radius, second.radius)
    field: str
    value: float
    if not packing.regular:
        field, value = "packing.seed", packing.seed
    elif yarn[f] == yarn[g]:
        row_ends = np.cumsum(first.rows)
        rows = np.searchsorted(row_ends, places, side="right")
        key = "spacing" if rows[0] == rows[1] else "row_spacing"
        field, value = f"yarns.{first.name}.{key}", first.spacing if key == "spacing" else first.row_spacing
    elif (yarn[f] < len(weave.warp)) == (yarn[g] < len(weave.warp)):
        side = weave.directions[int(yarn[f] >= len(weave.warp))]
        field, value = weave.key(side, "pitch"), side.pitch
    else:
        field, value = "weave.amplitude", weave.amplitude
    return DesignError(
        field,
        value,
        f"{labels[0]} and {labels[1]} {_COUNTED} start {excess + allowed:.4g} mm "
        f"inside one another, at most {allowed:.4g} mm (the smaller radius) is allowed",
    )
