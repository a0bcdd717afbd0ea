"""Values that are made fast are frozen dataclasses as any other."""

from __future__ import annotations

import copy
import inspect
import pickle
from dataclasses import FrozenInstanceError, dataclass, field, fields, replace

import pytest

from fubini._values import value


def declared(name, decorate):
    """The same class, decorated."""

    class Declared:
        a: int
        b: list[int] = field(default_factory=list)
        c: str = "c"
        fields: int = 0

        def __post_init__(self) -> None:
            if self.a < 0:
                raise ValueError("a")

    Declared.__name__ = Declared.__qualname__ = name
    return decorate(Declared)


Usual = declared("Usual", dataclass(frozen=True))
Fast = declared("Fast", value(frozen=True))


@pytest.mark.parametrize(
    "given", [((1,), {}), ((1, [2]), {}), ((1,), {"c": "d"}), ((), {"c": "d", "a": 1, "b": [3], "fields": 2})]
)
def test_they_are_as_dataclasses(given):
    args, named = given
    fast, usual = Fast(*args, **named), Usual(*args, **named)
    assert vars(fast) == vars(usual)
    assert repr(fast) == repr(usual).replace("Usual", "Fast")
    assert fast == Fast(*args, **named) == copy.copy(fast) == pickle.loads(pickle.dumps(fast))
    assert fast != replace(fast, a=7) == Fast(7, fast.b, fast.c, fast.fields)
    assert [f.name for f in fields(fast)] == [f.name for f in fields(usual)]
    assert inspect.signature(Fast) == inspect.signature(Usual)


@pytest.mark.parametrize("args", [(), (1, [], "c", 4, 5)])
def test_wrong_arguments_are_refused(args):
    for kind in (Usual, Fast):
        with pytest.raises(TypeError):
            kind(*args)


def test_they_are_frozen_and_checked():
    fast = Fast(1)
    assert Fast(1).b is not fast.b
    with pytest.raises(FrozenInstanceError):
        fast.a = 2
    with pytest.raises(ValueError, match="a"):
        Fast(-1)
    with pytest.raises(ValueError, match="a"):
        replace(fast, a=-1)
