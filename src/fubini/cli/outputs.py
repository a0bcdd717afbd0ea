"""What ``fubini mesh`` and ``fubini remesh`` write and say."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fubini.cli.common import check_outputs, dump_json, json_files, write_json

if TYPE_CHECKING:
    from fubini.result import Mesh


def check_paths(source: str, outputs: tuple[str, ...], json_path: str | None, picture: str | None) -> None:
    """Find out before the work what would fail after it."""
    from fubini.export import check_path

    for path in outputs:
        check_path(path)
    if picture is not None:
        from fubini.report.canvas import check_picture_path, require_matplotlib

        check_picture_path(picture)
        require_matplotlib()
    check_outputs(source, [*outputs, *json_files(json_path), *([picture] if picture else [])])


def write_all(result: Mesh, outputs: tuple[str, ...], json_path: str | None, picture: str | None) -> dict[str, Any]:
    """Write all outputs or none; the figures with the time of writing among them."""
    from fubini.export import Transaction, save_all
    from fubini.report import plot, to_json
    from fubini.report.canvas import write_figure

    begin = time.perf_counter()
    with Transaction() as files:
        save_all(result, outputs, files)
        if picture is not None:
            write_figure(plot(result), picture, files)
        data = to_json(result)
        data["seconds"]["write"] = time.perf_counter() - begin
        write_json(data, json_path, files)
    return data


def tell(result: Mesh, data: dict[str, Any], outputs: tuple[str, ...], json_path: str | None, quiet: bool) -> None:
    """Print the figures or the table, and what files cannot hold."""
    if json_path == "-":
        click.echo(dump_json(data), nl=False)
    elif not quiet:
        from fubini.report import table

        click.echo(table(result))
    _warn_of_rounding(result, outputs)
    _tell_renamed(result, outputs)


def _warn_of_rounding(result: Mesh, outputs: tuple[str, ...]) -> None:
    from fubini.export import FLOAT32_SUFFIXES, flawed_after_rounding

    single = [path for path in outputs if Path(path).suffix.lower() in FLOAT32_SUFFIXES]
    more = flawed_after_rounding(result) if single else 0
    if more:
        click.echo(
            f"fubini: warning: {more} more triangles are flawed in {', '.join(single)}, which holds single "
            "precision; .obj and .vtu hold double, or move the model to the origin",
            err=True,
        )


def _tell_renamed(result: Mesh, outputs: tuple[str, ...]) -> None:
    """Say what names became in files that cannot hold them."""
    from fubini.export import renamed

    for path in outputs:
        for name, title in renamed(result, path).items():
            click.echo(f"fubini: note: {name!r} is {title!r} in {path}", err=True)
