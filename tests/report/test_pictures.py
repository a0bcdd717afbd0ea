"""Pictures show what they should: looked at pixel by pixel."""

from __future__ import annotations

import dataclasses
import math
import sys

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.image import imread

from fubini.curves import CircularArc, Line
from fubini.errors import DependencyError, ExportError, OptionError
from fubini.model import Frame
from fubini.region import Loop, Region
from fubini.report import plot, plot_cells
from fubini.report.canvas import BOLD, EXCUSED_COLOUR, FILL, FLAWED_COLOUR
from fubini.report.picture import project
from handmade import bad_square, box, grid, one_face, square, wedge

OBLIQUE = Frame(np.array([3.0, 4, 5]), np.array([0.6, 0.8, 0.0]), np.array([0.0, 0.0, 1.0]))


def pixels(path, colour):
    """Number of pixels of nearly this colour above the caption (0.55 inches at 60 dpi)."""
    image = imread(path)[:-33, :, :3]
    return int((np.abs(image - to_rgb(colour)).max(2) < 0.06).sum())


def drawn(mesh, path, **options):
    mesh.plot(path, width=5.0, dpi=60.0, **options)
    return path


def test_red_where_flawed(tmp_path):
    good, bad = drawn(square(4), tmp_path / "good.png"), drawn(bad_square(), tmp_path / "bad.png")
    assert pixels(good, FLAWED_COLOUR) == 0
    p = bad_square().points[bad_square().triangles]
    from fubini.quality import areas, flawed

    share = areas(p)[flawed(p)].sum()
    ratio = pixels(bad, FLAWED_COLOUR) / (pixels(bad, FLAWED_COLOUR) + pixels(bad, FILL))
    assert ratio == pytest.approx(share, rel=0.1)


def test_orange_where_unavoidable(tmp_path):
    path = drawn(wedge(20.0), tmp_path / "a.png")
    assert pixels(path, EXCUSED_COLOUR) > 500
    assert pixels(path, FLAWED_COLOUR) == 0
    assert pixels(path, FILL) < 0.02 * pixels(path, EXCUSED_COLOUR)  # where outlines blend with white


def test_a_tiny_flawed_triangle_is_ringed(tmp_path):
    plane, triangles = grid(100)
    plane[5100] += (0.0092, 0.001)
    mesh = one_face([(0, 0), (1, 0), (1, 1), (0, 1)], plane, triangles)
    assert 0 < mesh.certificate.flawed < 5
    assert pixels(drawn(mesh, tmp_path / "a.png"), FLAWED_COLOUR) > 10


def test_flat_mesh_fills_its_plane(tmp_path):
    """A tilted square comes out as a square: as much fill as the drawing area holds, both ways."""
    path = drawn(square(1, frame=OBLIQUE), tmp_path / "a.png")
    image = imread(path)[:-33, :, :3]
    inked = np.argwhere(image.min(2) < 0.97)
    height, width = np.ptp(inked, axis=0)
    assert height == pytest.approx(width, abs=3)
    assert pixels(path, FILL) > 0.85 * height * width


def test_flat_and_deep_are_told_apart():
    assert project(square(2, frame=OBLIQUE), (1, -1, 1))[1] is None
    assert project(box(2), (1, -1, 1))[1] is not None


def test_near_faces_hide_far_ones(tmp_path):
    """Seen from above, a bad far face of the box is hidden; seen from below it shows."""
    mesh = box(2)
    points = mesh.points.copy()
    low = np.flatnonzero((points == [0.5, 0.5, 0.0]).all(1))
    points[low] = (0.9, 0.6, 0.0)
    mesh = dataclasses.replace(mesh, points=points)
    above = drawn(mesh, tmp_path / "above.png", view=(0.3, -0.3, 1.0))
    below = drawn(mesh, tmp_path / "below.png", view=(0.3, -0.3, -1.0))
    assert pixels(above, FLAWED_COLOUR) == 0
    assert pixels(below, FLAWED_COLOUR) > 100


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
@pytest.mark.parametrize("make", [bad_square, lambda: box(2)])
def test_same_bytes_twice(tmp_path, suffix, make):
    drawn(make(), tmp_path / f"a{suffix}")
    drawn(make(), tmp_path / f"b{suffix}")
    first = (tmp_path / f"a{suffix}").read_bytes()
    assert first == (tmp_path / f"b{suffix}").read_bytes()
    assert len(first) > 2000


def test_many_triangles_stay_legible(tmp_path):
    """At a hundred thousand triangles edges fade, so that the fill still shows and CAD edges stand out."""
    path = tmp_path / "a.png"
    square(224).plot(path, width=5.0, dpi=100.0)
    image = imread(path)[50:350, 100:400, :3]
    assert 0.5 < image.mean() < 0.97
    assert pixels(path, BOLD) > 500


def test_caption_and_figure():
    figure = plot(bad_square(), title="Part 7")
    text = " ".join(t.get_text() for t in figure.texts)
    assert "Part 7: not certified" in text
    assert f"{bad_square().certificate.flawed} flawed" in text
    assert "1 triangle, 1 flawed (1 unavoidable)" in " ".join(t.get_text() for t in plot(wedge()).texts)


def test_options_are_checked(tmp_path):
    with pytest.raises(ExportError, match=r"\.png"):
        plot(square(), tmp_path / "a.jpeg")
    with pytest.raises(OptionError, match="no direction"):
        plot(box(1), view=(0, 0, 0))
    with pytest.raises(OptionError, match="dpi"):
        plot(square(), dpi=math.nan)
    assert not list(tmp_path.iterdir())


def test_missing_matplotlib_is_explained(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(DependencyError, match=r"pip install .fubini\[plot\]"):
        plot(square())


def quarter() -> Region:
    """A quarter disk."""
    arc = CircularArc((0.0, 0.0), 1.0, 0.0, 0.5 * math.pi)
    lines = [Line(arc.end, (0.0, 0.0)), Line((0.0, 0.0), arc.start)]
    return Region(Loop((arc, *lines)))


def test_cells_picture(tmp_path):
    from fubini.cells import decompose

    holed = Region.polygon([(0, 0), (4, 0), (4, 3), (0, 3)], [[(1, 1), (1, 2), (2, 2), (2, 1)]])
    regions = [holed, quarter()]
    groups = [decompose(r, "x") for r in regions]
    figure = plot_cells(regions, groups, tmp_path / "a.png", titles=["one", "two"], width=5.0, dpi=60.0)
    assert [t.get_text() for t in figure.axes[0].texts][:1]
    assert f"{len(groups[0]) + 1} cells on 2 faces" in " ".join(t.get_text() for t in figure.texts)
    assert pixels(tmp_path / "a.png", BOLD) > 200
    plot_cells(quarter(), decompose(quarter(), "y"), tmp_path / "b.svg")
    plot_cells(quarter(), decompose(quarter(), "y"), tmp_path / "c.svg")
    assert (tmp_path / "b.svg").read_bytes() == (tmp_path / "c.svg").read_bytes()


def test_slices_are_drawn_once():
    from fubini.cells import decompose
    from fubini.report.cells import slices

    ring = Region.polygon([(0, 0), (4, 0), (4, 3), (0, 3)], [[(1, 1), (1, 2), (2, 2), (2, 1)]])
    found = sorted(tuple(map(tuple, line.tolist())) for line in slices(decompose(ring, "x")))
    assert found == [((x, 0.0), (x, 3.0)) for x in (0.0, 1.0, 2.0, 4.0)]


def test_cell_outline_has_the_cell_area():
    from fubini.cells import decompose
    from fubini.report.cells import colours, outline

    for direction in ("x", "y"):
        (cell,) = decompose(quarter(), direction)
        x, y = outline(cell).T
        area = 0.5 * abs((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
        assert area == pytest.approx(math.pi / 4, rel=2e-3)
    ring = Region.polygon([(0, 0), (4, 0), (4, 3), (0, 3)], [[(1, 1), (1, 2), (2, 2), (2, 1)]])
    cells = decompose(ring, "x")
    chosen = colours(cells)
    assert all(chosen[i] != chosen[j] for i, cell in enumerate(cells) for j in cell.neighbours)
