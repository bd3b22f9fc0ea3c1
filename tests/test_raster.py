"""The picture of triangles: areas in closed form, what hides what, no gaps between neighbours."""

from __future__ import annotations

import numpy as np
import pytest

from circuittex.results.plot.raster import picture

RED, BLUE = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
TRIANGLE = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]])


def covered(pixels: np.ndarray, channel: int) -> np.ndarray:
    """How much of each pixel is of the colour that leaves `channel` dark, from 0 to 1; white is not."""
    return np.asarray(1.0 - pixels[..., channel])


@pytest.mark.parametrize("turned", [False, True])
def test_area_of_a_triangle(turned: bool) -> None:
    corners = TRIANGLE[::-1] if turned else TRIANGLE  # the sense of rotation does not matter
    drawn = picture(corners[None], RED[None], 400)
    left, right, bottom, top = drawn.extent
    rows, columns, _ = drawn.pixels.shape
    pixel = (right - left) / columns
    assert (top - bottom) / rows == pytest.approx(pixel)
    assert max(rows, columns) in (402, 403)  # one pixel of white all round
    # 6 mm2, to the samples that an edge of 12 mm may gain: half a pixel of 0.01 mm.
    assert covered(drawn.pixels, 1).sum() * pixel**2 == pytest.approx(6.0, abs=12.0 * pixel / 2)


def test_a_pixel_is_where_it_should_be() -> None:
    drawn = picture(TRIANGLE[None], RED[None], 100)
    left, right, bottom, top = drawn.extent
    rows, columns, _ = drawn.pixels.shape
    x = left + (np.arange(columns) + 0.5) * (right - left) / columns
    y = top - (np.arange(rows) + 0.5) * (top - bottom) / rows
    inside = (x > 0.0) & (y[:, None] > 0.0) & (x / 4.0 + y[:, None] / 3.0 < 1.0)
    shown = covered(drawn.pixels, 1) > 0.5
    edge = np.abs(x / 4.0 + y[:, None] / 3.0 - 1.0) < 0.02
    assert np.array_equal(shown[~edge], inside[~edge])


def test_the_nearer_triangle_shows_also_where_two_cross() -> None:
    flat = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 2.0, 0.0]])
    tilted = flat.copy()
    tilted[:, 2] = flat[:, 0]  # nearer on the right, farther on the left
    for order in ([0, 1], [1, 0]):
        pixels = picture(np.stack([flat, tilted])[order], np.stack([RED, BLUE])[order], 200).pixels
        row = pixels[150]
        middle = row.shape[0] // 2
        assert np.array_equal(row[middle - 20], RED)
        assert np.array_equal(row[middle + 20], BLUE)


def test_neighbours_leave_no_gap() -> None:
    """Nine triangles round a point: the regular polygon they fill has no white inside its inner circle."""
    angle = 2 * np.pi * np.arange(9) / 9 + 0.1
    rim = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    middle = np.broadcast_to([0.13, -0.22, 0.0], rim.shape)
    drawn = picture(np.stack([middle, rim, np.roll(rim, -1, axis=0)], axis=1), np.broadcast_to(RED, (9, 3)), 300)
    left, right, bottom, top = drawn.extent
    rows, columns, _ = drawn.pixels.shape
    x = left + (np.arange(columns) + 0.5) * (right - left) / columns
    y = top - (np.arange(rows) + 0.5) * (top - bottom) / rows
    inside = np.hypot(x, y[:, None]) < np.cos(np.pi / 9) - 0.02
    assert inside.sum() > 10_000
    assert (drawn.pixels[inside] == RED).all()
