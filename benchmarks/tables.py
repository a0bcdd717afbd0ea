"""Tables and plots of the comparison, from its CSV files: ``python benchmarks/compare.py --render``."""

from __future__ import annotations

import csv
import re
import statistics
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
#: Number of triangles at which histograms of skewness are kept.
HISTOGRAM = 20_000
COLUMNS = (
    "face", "count", "tool", "triangles", "flawed", "unavoidable", "worst_skew", "mean_skew", "worst_ar", "mean_ar",
    "boundary_distance", "area_error", "cpu", "cpu_all", "wall", "runs", "memory", "ratio", "ratio_all", "error",
)  # fmt: skip
MEANS = (("mean_skew", 1), ("mean_ar", 3))
TEXTS = ("face", "tool", "error")

#: Colour and dashes of each tool; a tool and its optimiser share a colour.
STYLES = {
    "fubini": ("#c2321f", "-"),
    "gmsh 6": ("#1f5f8b", "-"),
    "gmsh 6 + Laplace2D": ("#1f5f8b", "--"),
    "gmsh 5": ("#6aa9d2", "-"),
    "gmsh 5 + Laplace2D": ("#6aa9d2", "--"),
    "netgen": ("#3c8d40", "-"),
    "triangle q30": ("#7a4fa3", "--"),
    "triangle q33": ("#7a4fa3", "-"),
    "PythonCDT 33": ("#c98a1b", "-"),
}


def write_rows(path: Path, columns: tuple[str, ...], rows: list[dict]) -> None:
    """Rows as CSV with all digits; keys beside the columns are left out."""
    with open(path, "w", newline="") as file:
        table = csv.DictWriter(file, columns, extrasaction="ignore", restval="", lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def read_rows(path: Path, texts: tuple[str, ...]) -> list[dict]:
    """Rows of a CSV file, all but the columns ``texts`` as numbers, without empty fields."""
    with open(path, newline="") as file:
        return [{k: v if k in texts else float(v) for k, v in row.items() if v} for row in csv.DictReader(file)]


def read(out: Path) -> list[dict]:
    """Rows of OUT.csv, figures as numbers."""
    return read_rows(out.with_name(out.name + ".csv"), TEXTS)


def line(row: dict) -> str:
    """One row of the full table."""
    head = f"| {row['face']} | {row['tool']} |"
    if "error" in row:
        return f"{head} {row['count']:,.0f} wanted: {row['error']} |" + " |" * 10
    return (
        head + " {triangles:,.0f} | {flawed:.0f} ({unavoidable:.0f}) | {worst_skew:.1f}, {mean_skew:.1f} "
        "| {worst_ar:.2f}, {mean_ar:.3f} | {boundary_distance:.0e} | {area_error:.1e} | {cpu:.4f} | {wall:.4f} "
        "| {megabytes:.1f} | {ratio:.2f} | {ratio_all:.2f} |"
    ).format(**{"ratio": float("nan"), "ratio_all": float("nan"), **row}, megabytes=row["memory"] / 1e6)


def full_table(rows: list[dict]) -> str:
    """Every row."""
    head = (
        "face", "tool", "triangles", "flawed (unavoidable)", "worst, mean skewness", "worst, mean aspect ratio",
        "boundary distance", "area error", "CPU s", "wall s", "peak MB", "time / ours", "time / ours with certificate",
    )  # fmt: skip
    return table(head, []) + "".join(line(row) + "\n" for row in rows)


def table(head: tuple, body: list[list]) -> str:
    """Markdown."""
    lines = [list(map(str, head)), ["---"] * len(head), *[list(map(str, row)) for row in body]]
    return "".join("| " + " | ".join(cells) + " |\n" for cells in lines)


def good(rows: list[dict], **wanted: object) -> list[dict]:
    """Rows without an error whose entries are as wanted."""
    return [r for r in rows if "error" not in r and all(r[k] == v for k, v in wanted.items())]


def tools_of(rows: list[dict]) -> list[str]:
    return list(dict.fromkeys(row["tool"] for row in rows))


def ratio_table(rows: list[dict], key: str) -> str:
    """CPU time a triangle over fubini's: median over the faces, by tool and count; last row fubini's own time."""
    counts = sorted({row["count"] for row in rows})
    own = "cpu" if key == "ratio" else "cpu_all"
    body = []
    for tool in tools_of(rows):
        if tool != "fubini":
            body.append([tool, *(_spread(good(rows, tool=tool, count=c), key) for c in counts)])
    micro = []
    for c in counts:
        times = [1e6 * r[own] / r["triangles"] for r in good(rows, tool="fubini", count=c)]
        micro.append(f"{statistics.median(times):.3g}" if times else "")
    return table(("tool", *(f"{c:,.0f}" for c in counts)), [*body, ["fubini, microseconds a triangle", *micro]])


def _spread(rows: list[dict], key: str) -> str:
    """Median of the faces, and their least and largest where there is more than one."""
    values = [row[key] for row in rows if key in row]
    if not values:
        return ""
    middle = f"**{_digits(statistics.median(values))}**"
    return middle if len(values) == 1 else f"{middle} ({_digits(min(values))} to {_digits(max(values))})"


def _digits(value: float) -> str:
    """Three significant digits, no exponent."""
    return f"{value:.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2f}"


def quality_table(rows: list[dict]) -> str:
    """Over all faces and counts that a tool took part in."""
    body = []
    for tool in tools_of(rows):
        own = good(rows, tool=tool)
        if not own:
            continue
        clean = sum(r["flawed"] <= r["unavoidable"] for r in own)
        at = good(rows, tool=tool, count=HISTOGRAM)
        mean = [f"{statistics.mean(r[k] for r in at):.{d}f}" if at else "" for k, d in MEANS]
        body.append([
            tool, len(own), clean, f"{sum(r['flawed'] for r in own):,.0f}", f"{min(r['worst_skew'] for r in own):.1f}",
            f"{max(r['worst_ar'] for r in own):.2f}", *mean, f"{max(r['boundary_distance'] for r in own):.0e}",
        ])  # fmt: skip
    head = (
        "tool", "meshes", "without a flawed triangle", "flawed triangles", "worst skewness", "worst aspect ratio",
        f"mean skewness at {HISTOGRAM:,}", f"mean aspect ratio at {HISTOGRAM:,}", "boundary distance",
    )  # fmt: skip
    return table(head, body)


def worst_table(rows: list[dict]) -> str:
    """Worst skewness on each face, by count, of fubini and of the better of Gmsh's optimised meshes."""
    faces = list(dict.fromkeys(row["face"] for row in rows))
    counts = sorted({row["count"] for row in rows})
    body = []
    for name in ("fubini", "gmsh 6 + Laplace2D", "triangle q33"):
        for face in faces:
            cells = []
            for c in counts:
                found = good(rows, tool=name, face=face, count=c)
                cells.append(f"{found[0]['worst_skew']:.1f}, {found[0]['mean_skew']:.1f}" if found else "")
            body.append([name, face, *cells])
    return table(("tool", "face", *(f"{c:,.0f}" for c in counts)), body)


def memory_table(rows: list[dict]) -> str:
    """Bytes a triangle at peak, above what the process held before: median over the faces."""
    counts = [c for c in sorted({row["count"] for row in rows}) if c >= HISTOGRAM]
    body = []
    for tool in tools_of(rows):
        found = [[r["memory"] / r["triangles"] for r in good(rows, tool=tool, count=c)] for c in counts]
        body.append([tool, *(f"{statistics.median(f):,.0f}" if f else "" for f in found)])
    return table(("tool", *(f"{c:,.0f}" for c in counts)), body)


def findings(rows: list[dict]) -> str:
    """The result in sentences."""
    counts = sorted({row["count"] for row in rows})
    lines = []
    for tool, name in (("gmsh 6", "Gmsh's Frontal-Delaunay"), ("triangle q33", "Triangle with `-q33`")):
        middle = {c: [r["ratio"] for r in good(rows, tool=tool, count=c)] for c in counts}
        said = [f"{_digits(statistics.median(v))} at {c:,.0f}" for c, v in middle.items() if v]
        lines.append(f"- Times the CPU time of fubini that {name} takes for a triangle: {', '.join(said)} triangles.")
    clean = [
        f"{tool} {sum(r['flawed'] <= r['unavoidable'] for r in own)} of {len(own)}"
        for tool in tools_of(rows) if (own := good(rows, tool=tool))
    ]  # fmt: skip
    lines.append(f"- Meshes without a flawed triangle: {', '.join(clean)}.")
    pairs = [
        (ours[0], theirs[0]) for theirs in ([r] for r in good(rows, tool="gmsh 6 + Laplace2D"))
        if (ours := good(rows, tool="fubini", face=theirs[0]["face"], count=theirs[0]["count"]))
    ]  # fmt: skip
    for key, word in (("worst_skew", "worst"), ("mean_skew", "mean")):
        above = sum(a[key] >= b[key] for a, b in pairs)
        lines.append(
            f"- The {word} skewness of fubini's mesh is at least that of Gmsh's optimised one in {above} of "
            f"{len(pairs)} cases."
        )
    return "\n".join(lines) + "\n"


def plot_times(rows: list[dict], path: Path) -> None:
    """CPU time against triangles, a panel a face, a line a tool."""
    from matplotlib.figure import Figure

    faces = list(dict.fromkeys(row["face"] for row in rows))
    figure = Figure(figsize=(9.5, 4.0 * ((len(faces) + 1) // 2) + 0.7), layout="constrained")
    grid = figure.subplots((len(faces) + 1) // 2, min(2, len(faces)), sharex=True, sharey=True, squeeze=False)
    for axes, face in zip(grid.ravel(), faces):
        for tool, (colour, dashes) in STYLES.items():
            own = sorted(good(rows, tool=tool, face=face), key=lambda r: r["triangles"])
            wide = 2.4 if tool == "fubini" else 1.2
            x, y = [r["triangles"] for r in own], [r["cpu"] for r in own]
            axes.loglog(x, y, dashes, color=colour, lw=wide, marker="o", ms=1.4 * wide, label=tool, zorder=wide)
        axes.set_title(face, fontsize=10)
        axes.grid(which="major", color="#dddddd", lw=0.6)
    for axes in grid[-1]:
        axes.set_xlabel("triangles")
    for axes in grid[:, 0]:
        axes.set_ylabel("CPU seconds, mesh only")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, frameon=False, fontsize=9)
    save(figure, path)


def plot_skewness(out: Path, path: Path) -> None:
    """Histograms of skewness, all faces together, a panel a tool."""
    from matplotlib.figure import Figure

    with open(out.with_name(out.name + "-skewness.csv"), newline="") as file:
        found: dict[str, np.ndarray] = {}
        for _, _, tool, *counts in list(csv.reader(file))[1:]:
            found[tool] = found.get(tool, 0) + np.array(counts, float)
    if not found:
        return
    figure = Figure(figsize=(9.5, 2.0 * ((len(found) + 2) // 3)), layout="constrained")
    grid = figure.subplots((len(found) + 2) // 3, 3, sharex=True, sharey=True, squeeze=False)
    for axes in grid.ravel()[len(found) :]:
        axes.set_axis_off()
    for axes, (tool, counts) in zip(grid.ravel(), found.items()):
        axes.bar(np.arange(90) + 0.5, 100 * counts / counts.sum(), width=1.0, color=STYLES[tool][0])
        axes.axvline(45, color="#444444", lw=0.8, ls=":")
        low = np.flatnonzero(counts)[0]
        axes.set_title(f"{tool}: from {low}°", fontsize=9)
        axes.set_yscale("log")
        axes.set_xlim(30, 90)
        axes.set_ylim(1e-3, 100)
    for axes in grid[-1]:
        axes.set_xlabel("skewness, degrees")
    for axes in grid[:, 0]:
        axes.set_ylabel("% of triangles")
    save(figure, path)


def save(figure, path: Path) -> None:
    """A small PNG, the same bytes for the same picture."""
    import io

    from PIL import Image

    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110, facecolor="white")
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.open(buffer).convert("RGB").quantize(64, dither=Image.Dither.NONE).save(path, optimize=True)


def replace_block(path: Path, name: str, text: str) -> None:
    """Put the text between the markers of this name in a Markdown file."""
    start, end = f"<!-- {name}: made by script -->", f"<!-- end of {name} -->"
    old = path.read_text()
    new = re.sub(re.escape(start) + ".*?" + re.escape(end), lambda _: f"{start}\n\n{text}\n{end}", old, flags=re.S)
    path.write_text(new)


def render(out: Path, docs: bool) -> None:
    """OUT.md and OUT*.png; with ``docs`` the tables and plots of the documentation and of the README here."""
    rows = read(out)
    parts = {
        "findings": findings(rows),
        "speed": ratio_table(rows, "ratio"),
        "certified": ratio_table(rows, "ratio_all"),
        "quality": quality_table(rows),
        "worst": worst_table(rows),
        "memory": memory_table(rows),
    }
    text = "\n".join([*parts.values(), full_table(rows)])
    out.with_name(out.name + ".md").write_text(text)
    if not docs:
        plot_times(rows, out.with_name(out.name + "-time.png"))
        plot_skewness(out, out.with_name(out.name + "-skewness.png"))
        return
    plot_times(rows, ROOT / "docs" / "images" / "compare_time.png")
    plot_skewness(out, ROOT / "docs" / "images" / "compare_skewness.png")
    for name, part in parts.items():
        (ROOT / "docs" / "benchmarks" / f"compare_{name}.table").write_text(part)
        replace_block(ROOT / "benchmarks" / "README.md", name, part)
