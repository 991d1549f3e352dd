"""What notebooks show."""

from __future__ import annotations

from html import escape
from typing import Any


def _table(head: list[str], rows: list[list[Any]]) -> str:
    cells = "".join(f"<th>{escape(str(c))}</th>" for c in head)
    body = "".join("<tr>" + "".join(f"<td>{escape(str(c))}</td>" for c in row) + "</tr>" for row in rows)
    return f"<table><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table>"


def diagnostics_html(diagnostics: list[dict[str, Any]]) -> str:
    """Findings with their places."""
    place = lambda d: f"{d['file']}:{d['line']}:{d['column']}" if d.get("line") else ""
    rows = [[place(d), f"{d['severity']}[{d['code']}]", d["message"], d.get("help") or ""] for d in diagnostics]
    return _table(["place", "code", "message", "help"], rows)


def system_html(system: Any) -> str:
    """Names and sizes, the matrices below."""
    rows = [[letter, "×".join(map(str, getattr(system, letter).shape)), getattr(system, letter)] for letter in "ABCDEG"]
    names = ", ".join(s["name"] for s in system.states) or "none"
    ports = ", ".join(p["device"] for p in system.ports) or "none"
    return f"<p>{escape(system.title)}: states {escape(names)}; ports {escape(ports)}</p>" + _table(["matrix", "shape", "entries"], rows)


def waveforms_html(waves: Any) -> str:
    """Extrema of every signal, and a line of each."""
    rows = []
    for k, name in enumerate(waves.names):
        column = waves.values[:, k]
        rows.append([name, waves.units[k], f"{column.min():.6g}", f"{column.max():.6g}", f"{column[-1]:.6g}"])
    head = f"<p>{escape(waves.title)}: {len(waves.time)} rows to {waves.time[-1]:g} s, {len(waves.events)} events</p>"
    return head + _table(["signal", "unit", "least", "largest", "last"], rows)
