"""How objects show themselves in a notebook: tables of what they hold."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from cspm.signals import Signals


def table(title: str, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a titled HTML table.

    Args:
        title: above it, as text.
        heads: of the columns, as text.
        rows: cells as text.
    """
    top = "".join(f"<th scope=col>{escape(head)}</th>" for head in heads)
    body = "".join(
        f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in rows
    )
    return f"<p><b>{escape(title)}</b></p><table><tr>{top}</tr>{body}</table>"


def signals_table(title: str, source: Signals) -> str:
    """Return an HTML table of the signals of a run or recording: samples, columns, range."""
    heads = ("signal", "samples", "columns", "least", "greatest", "unit")
    rows = []
    for name in source.names:
        signal = source.signal(name)
        ends = (f"{signal.values.min():.4g}", f"{signal.values.max():.4g}")
        units = ", ".join(dict.fromkeys(signal.units))
        rows.append((name, str(len(signal)), ", ".join(signal.columns), *ends, units))
    return table(title, heads, rows)
