"""Tables of the report: scores, ledger, what was left out, config, versions."""

from __future__ import annotations

import math
from html import escape


def table(header: list[str], rows: list[list[str]], numeric: tuple[int, ...] = ()) -> str:
    """Return an HTML table; the cells are HTML already, columns in `numeric` are right-aligned."""
    def cells(tag, row):
        return "".join(f"<{tag}{' class=n' if i in numeric else ''}>{cell}</{tag}>" for i, cell in enumerate(row))

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return f"<div class=scroll><table><thead><tr>{cells('th', header)}</tr></thead><tbody>{body}</tbody></table></div>"


def number(value) -> str:
    """Return a number for people: four significant digits, a dash where there is none."""
    if value is None or value != value:
        return "&ndash;"
    return f"{value:,.0f}" if 1e3 <= abs(value) < 1e6 else f"{value:.4g}"


def scores(result, of_objects: bool) -> str:
    """Return one row per metric (and object), one column per camera, 95 % intervals beneath the values."""
    cells: dict[tuple, dict[str, str]] = {}
    for s in result.scores:
        if bool(s["object"]) == of_objects:
            low, high = s["low"], s["high"]
            known = low is not None and high is not None and 0 < high - low < math.inf     # NaN compares as unknown
            interval = "" if not known else f"<small>{number(low)} to {number(high)}</small>"
            cells.setdefault((s["object"], s["metric"], s["unit"]), {})[s["camera"]] = number(s["value"]) + interval
    first = ["object"] if of_objects else []
    rows = [([escape(o)] if of_objects else []) + [escape(m), escape(u), *(row.get(c, "&ndash;") for c in result.cameras)]
            for (o, m, u), row in cells.items()]
    offset = len(first) + 2
    return table([*first, "metric", "unit", *map(escape, result.cameras)], rows,
                 tuple(range(offset, offset + len(result.cameras))))


def ledger(rows) -> str:
    """Return stage, seconds, peak memory and stated errors."""
    def errors(row):
        return "<br>".join(f"{escape(e.what)} <b>{number(e.value)}</b> {escape(e.unit)} <i>{e.how}</i>" for e in row.errors) or "&ndash;"

    total = sum(r.seconds for r in rows)
    body = [[escape(r.stage), f"{r.seconds:.2f}", f"{r.peak_bytes / 1e6:,.0f}", errors(r)] for r in rows]
    body.append(["<b>all</b>", f"<b>{total:.1f}</b>", f"{max((r.peak_bytes for r in rows), default=0) / 1e6:,.0f}", ""])
    return table(["stage", "seconds", "peak MB", "error"], body, (1, 2))


def left_out(rows) -> str:
    """Return what was not computed, why, and the largest change that can make."""
    body = [[escape(r.stage), escape(o.what), escape(o.why), f"{number(o.bound)} {escape(o.unit)}"] for r in rows for o in r.left_out]
    return table(["stage", "what", "why", "bound on its effect"], body) if body else "<p>Nothing was left out.</p>"


def key_values(data: dict) -> str:
    """Return a two-column table of a flat dictionary."""
    return table(["", ""], [[escape(str(k)), escape(str(v))] for k, v in data.items()])


def config(data: dict) -> str:
    """Return a nested config as YAML text."""
    from omegaconf import OmegaConf

    return f"<pre>{escape(OmegaConf.to_yaml(OmegaConf.create(data)))}</pre>"
