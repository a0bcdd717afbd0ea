"""Messages of errors: the place, the trouble, the fix."""

from __future__ import annotations

import pytest

from fubini.errors import DependencyError, ExportError, FubiniError, GeometryError, InputError, OptionError


def test_message_names_place_and_fix():
    error = GeometryError(
        "loop is open", file="part.step", face=3, edge=17, at=(1.0, 2.5, 0), fix="close the gap of 0.01"
    )
    assert str(error) == "part.step: face 3: edge 17: at (1, 2.5, 0): loop is open (close the gap of 0.01)"
    assert (error.file, error.face, error.edge, error.at) == ("part.step", 3, 17, (1.0, 2.5, 0.0))


def test_face_and_edge_zero_are_named():
    assert str(InputError("no outer loop", face=0, edge=0)) == "face 0: edge 0: no outer loop"


def test_bare_message_stays_bare():
    assert str(FubiniError("nothing to mesh")) == "nothing to mesh"


@pytest.mark.parametrize(
    ("kind", "builtin"),
    [
        (InputError, ValueError),
        (GeometryError, ValueError),
        (OptionError, ValueError),
        (ExportError, OSError),
        (DependencyError, ImportError),
    ],
)
def test_each_error_is_also_the_builtin_kind(kind, builtin):
    with pytest.raises(builtin) as caught:
        raise kind("wrong", fix="mend it")
    assert isinstance(caught.value, FubiniError)
    assert str(caught.value) == "wrong (mend it)"
