"""Names as a format can hold them: allowed characters, limited length, still told apart."""

from __future__ import annotations

from collections.abc import Callable, Iterable


def titles(
    names: Iterable[str],
    longest: int,
    clean: Callable[[str], str] = str,
    taken: Iterable[str] = (),
    fold: bool = False,
) -> dict[str, str]:
    """Name to title: cleaned, at most ``longest`` characters, unique, and none of ``taken``.

    The first of several names of one title keeps it, the others end on ``_2``, ``_3``, ... With ``fold`` capitals and
    small letters are the same.
    """

    def key(title: str) -> str:
        return title.upper() if fold else title

    seen = {key(title) for title in taken}
    result: dict[str, str] = {}
    for name in names:
        base = clean(name)
        title, k = base[:longest], 2
        while key(title) in seen:
            end = f"_{k}"
            title, k = base[: longest - len(end)] + end, k + 1
        seen.add(key(title))
        result[name] = title
    return result


def changed(found: dict[str, str]) -> dict[str, str]:
    """The names that have another title."""
    return {name: title for name, title in found.items() if name != title}
