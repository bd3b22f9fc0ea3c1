"""Values of every cell of a panel: one number, a formula of x and y, a table in a file, or an image."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from circuittex.base.arrays import Floats
from circuittex.base.errors import DesignError
from circuittex.design.checks import refuse
from circuittex.design.table import Table, quantity
from circuittex.study.panel.formula import evaluate
from circuittex.study.panel.statement import places

_IMAGES = (".png", ".jpg", ".jpeg", ".tif", ".tiff")
_WAYS = ("uniform", "formula", "file", "image")
_LARGEST_FILE = 400_000_000
"""Bytes of a table or an image at most."""
_GREY = np.array([0.2126, 0.7152, 0.0722])
"""Luminance of red, green and blue (ITU-R BT.709)."""


def read_map(table: Table, shape: tuple[int, int], pitch: float, unit: str, folder: Path) -> Floats:
    """Values (n, m) that a table of a panel file states in one of four ways.

    `uniform`: one for all. `formula`: of x and y in mm, from the corner of the panel. `file`: .npy or .csv with a row
    for each warp yarn, warp1 first, and a column for each weft yarn. `image`: its brightness, from `low` at black to
    `high` at white, stretched over the panel; its lower edge is that of the panel.

    Raises `DesignError` for a file that cannot be used.
    """
    ways = [way for way in _WAYS if table.has(way)]
    if len(ways) != 1:
        raise refuse(table.field, ways or "nothing", f"it has one of {', '.join(_WAYS)}")
    (way,) = ways
    at = table.at(way)
    if way == "uniform":
        return np.full(shape, quantity(table.value[way], unit, at))
    text = table.text(way, "a formula" if way == "formula" else "the name of a file")
    if way == "formula":
        x, y = places(shape[1], pitch), places(shape[0], pitch)
        return evaluate(text, {"x": x[None, :], "y": y[:, None]}, at)
    path = folder / text
    if way == "file":
        return read_table(path, shape, at)
    low, high = (quantity(table.get(key, f"value of {what}"), unit, table.at(key)) for key, what in _ENDS)
    return read_image(path, shape, low, high, at)


_ENDS = (("low", "black"), ("high", "white"))


def read_table(path: Path, shape: tuple[int, int], field: str) -> Floats:
    """An array of exactly `shape` from a .npy or .csv file.

    Raises `DesignError` for anything else.
    """
    suffix = path.suffix.lower()
    if suffix == ".npy":
        found = _loaded(path, field, lambda: np.load(path, allow_pickle=False))
    elif suffix == ".csv":
        found = _loaded(path, field, lambda: np.loadtxt(path, delimiter=",", ndmin=2))
    else:
        raise refuse(field, path.name, "it must be a .npy or .csv file")
    if found.dtype.kind not in "fiub" or found.shape != shape:
        allowed = f"it must hold {shape[0]} x {shape[1]} numbers, a row for each warp yarn; it holds "
        raise refuse(field, path.name, f"{allowed}{' x '.join(map(str, found.shape)) or 'one'} of type {found.dtype}")
    values = found.astype(np.float64)
    if not np.isfinite(values).all():
        i, j = np.argwhere(~np.isfinite(values))[0]
        raise refuse(
            field, path.name, f"its numbers must be finite; {values[i, j]} stands for warp{i + 1}, weft{j + 1}"
        )
    return values


def read_image(path: Path, shape: tuple[int, int], low: float, high: float, field: str) -> Floats:
    """Brightness of an image at the places of the cells, bilinear between its pixels: `low` is black, `high` white.

    Raises `DesignError` for a file that is no image.
    """
    if path.suffix.lower() not in _IMAGES:
        raise refuse(field, path.name, f"it must be an image: {', '.join(_IMAGES)}")
    from matplotlib.image import imread

    pixels = _loaded(path, field, lambda: imread(path))
    white = 2.0 ** (8 * pixels.itemsize) - 1.0 if pixels.dtype.kind == "u" else 1.0  # 255, or 65535 of 16 bits
    grey = np.asarray(pixels, dtype=np.float64) / white
    if grey.ndim == 3:
        grey = grey[..., :3] @ _GREY if grey.shape[2] >= 3 else grey[..., 0]
    grey = grey[::-1]
    for axis, count in enumerate(shape):
        pixel = np.clip((np.arange(count) + 0.5) / count * grey.shape[axis] - 0.5, 0.0, grey.shape[axis] - 1.0)
        first = np.minimum(pixel.astype(np.int64), max(grey.shape[axis] - 2, 0))
        weight = (pixel - first)[:, None] if axis == 0 else pixel - first
        second = np.minimum(first + 1, grey.shape[axis] - 1)
        grey = (1.0 - weight) * grey.take(first, axis) + weight * grey.take(second, axis)
    return np.asarray(low + (high - low) * grey)


def _loaded(path: Path, field: str, load: Callable[[], Floats]) -> Floats:
    """What a file holds, if it can be read."""
    try:
        if path.stat().st_size > _LARGEST_FILE:
            raise refuse(field, path.name, f"it has more than {_LARGEST_FILE} bytes")
        return np.asarray(load())
    except FileNotFoundError:
        raise refuse(field, str(path), "there is no such file") from None
    except DesignError:
        raise
    except Exception as error:  # readers of foreign files raise whatever they like on what they cannot read
        reason = (str(error).strip() or type(error).__name__).splitlines()[0]
        raise refuse(field, path.name, f"it cannot be read: {reason}") from None
