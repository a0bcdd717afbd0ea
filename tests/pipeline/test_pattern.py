"""Models of several faces: reference sets of the paper on shared edges."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("OCP", reason="no CAD kernel installed")

from cad import shapes as S
from fubini.pipeline import load
from fubini.pipeline.options import MeshOptions
from fubini.pipeline.pattern import pattern_nodes
from fubini.pipeline.run import lay_pattern, outline_faces


@pytest.mark.parametrize("pattern", ["SP13", "SP41", "ASP20", "ASP48"])
def test_a_straight_edge_takes_the_nodes_of_one_face(pattern):
    model = load(S.plate())
    outlines, edges = outline_faces(model), model.numbering.edges
    points = lay_pattern(model, outlines, MeshOptions(pattern=pattern))
    nodes = pattern_nodes(len(edges), outlines, points)
    for e, index in enumerate(edges):
        if model.edges[index].kind != "line":
            continue
        asked = [
            np.union1d([0.0, 1.0], t)
            for outline, of_face in zip(outlines, points, strict=True)
            for edge, t in zip(outline.edges, of_face.on_curve, strict=True)
            if edge == e
        ]
        assert len(asked) == 2
        assert len(nodes.of(e)) == max(map(len, asked))
        assert any(len(t) == len(nodes.of(e)) and np.allclose(t, nodes.of(e)) for t in asked)
