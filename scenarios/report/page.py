"""A report as one HTML page that needs nothing else: texts escaped, styles, scripts and data inside.

The scripts are named by their hashes in a Content-Security-Policy that allows no network and no other script, so that
a title or an FMU's name can neither run nor load anything, even where escaping failed.
"""

from __future__ import annotations

import base64
import hashlib
import json
import math
from collections.abc import Callable, Iterator, Sequence
from html import escape
from importlib import resources
from string import Template
from typing import Any

from tlpsim.scenarios.report.document import (
    Block,
    Cell,
    Chart,
    Checks,
    Document,
    Drawing,
    Facts,
    Fold,
    Grid,
    Row,
    Section,
    Table,
    Text,
    Verbatim,
)
from tlpsim.scenarios.report.scene import scene_scripts

ANIMATION = "animation"
"""Anchor of the section that the scene fills."""

_ASSETS = resources.files("tlpsim.scenarios.report") / "assets"
_STYLES = ("vendor/uPlot.min.css", "report.css")
_BASE = ("unpack.js", "sharpness.js")
_UPLOT = "vendor/uPlot.iife.min.js"
_SWEEP = ("theme.js", "lines.js", "sweep.js", "sweep_colours.js", "plane.js")
_SCRIPTS = {
    "lines": (_UPLOT, "theme.js", "lines.js"),
    "series": (_UPLOT, "theme.js", "thinning.js", "lines.js", "gestures.js", "panel.js", "series.js"),
    "sweep": _SWEEP,
    "sweep_cells": (*_SWEEP, "cells.js"),
    "sweep_scatter": (*_SWEEP, "scatter.js"),
    "sweep_parallel": (*_SWEEP, "parallel.js"),
    "sweep_domains": (*_SWEEP, "domains.js"),
    "sweep_worst": (*_SWEEP, "sweep_table.js"),
}
"""Scripts of each kind of figure, each after those that it needs."""
_SCENE = ("theme.js",)
_START = "report.js"
_LONG = 12  # rows of a table that may go on on another sheet of paper
_SYMBOLS = {
    True: ("✓", "good", "good"),
    False: ("!", "attention", "needs a look"),
    None: ("·", "neutral", "for information"),
}


def page(document: Document) -> str:
    """HTML of a report."""
    data = _Data()
    sections = [section for section in document.sections if section.blocks]
    body = [_section(each, data) for each in sections]
    entries = [(each.anchor, each.title) for each in sections]
    kinds = [*_kinds(document.head), *(kind for each in sections for kind in _kinds(each.blocks))]
    names = [*_BASE, *(name for kind in kinds for name in _SCRIPTS[kind])]
    if document.scene is not None:
        names += _SCENE
    scripts = [_asset(name) for name in dict.fromkeys(names)]
    if document.scene is not None:
        # After the response: what happened, before the figures that explain it.
        body.insert(1, _animation(data.place(document.scene), document.scene_of))
        entries.insert(1, (ANIMATION, "Animation"))
        scripts.append(scene_scripts())
    scripts = [_script_safe(each) for each in (*scripts, _asset(_START))]
    contents = "".join(f'<li><a href="#{anchor}">{escape(title)}</a></li>' for anchor, title in entries)
    return Template(_asset("template.html")).substitute(
        policy=_policy(scripts),
        kind=escape(document.kind),
        title=escape(document.title),
        subtitle=escape(document.subtitle),
        status=escape(document.status),
        tone="good" if document.complete else "attention",
        styles="\n".join(_asset(name) for name in _STYLES),
        contents=contents,
        head="".join(_block(each, data) for each in document.head),
        sections="\n".join(body),
        data=data.json(),
        scripts="\n".join(f"<script>{each}</script>" for each in scripts),
    )


def _kinds(blocks: Sequence[Block]) -> Iterator[str]:
    """Kinds of the figures among blocks."""
    for block in blocks:
        if isinstance(block, Chart):
            yield block.kind
        elif isinstance(block, Grid | Fold):
            yield from _kinds(block.blocks)


class _Data:
    """What the scripts read: contents of the figures in their order, and each packed array once."""

    def __init__(self) -> None:
        self._contents: list[Any] = []
        self._arrays: dict[str, int] = {}

    def place(self, content: Any) -> int:
        """Number by which a script finds the content."""
        self._contents.append(self._shared(content))
        return len(self._contents) - 1

    def _shared(self, value: Any) -> Any:
        """The content with the number of an array in place of its text, and null for what is not finite."""
        if isinstance(value, float):
            return value if math.isfinite(value) else None
        if isinstance(value, dict):
            found = {key: self._shared(each) for key, each in value.items()}
            if isinstance(value.get("data"), str) and "count" in value:
                found["data"] = self._arrays.setdefault(value["data"], len(self._arrays))
            return found
        return [self._shared(each) for each in value] if isinstance(value, list | tuple) else value

    def json(self) -> str:
        """All of it for an element of the page, in which nothing can end the element."""
        content = {"contents": self._contents, "arrays": list(self._arrays)}
        text = json.dumps(content, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
        return text.replace("<", "\\u003c")


def _asset(name: str) -> str:
    return (_ASSETS / name).read_text(encoding="utf-8")


def _script_safe(text: str) -> str:
    """A script in which nothing ends its element; `<\\/` is `</` in strings, and only there these stand."""
    return text.replace("</script", "<\\/script").replace("<!--", "<\\!--")


def _policy(scripts: Sequence[str]) -> str:
    hashes = " ".join(
        f"'sha256-{base64.b64encode(hashlib.sha256(each.encode()).digest()).decode()}'" for each in scripts
    )
    return (
        f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; img-src data: blob:; "
        "base-uri 'none'; form-action 'none'"
    )


def _section(section: Section, data: _Data) -> str:
    blocks = "\n".join(_block(each, data) for each in section.blocks)
    return (
        f'<section id="{section.anchor}" aria-labelledby="{section.anchor}-title">'
        f'<h2 id="{section.anchor}-title">{escape(section.title)}</h2>\n{blocks}</section>'
    )


def _animation(number: int, which: str) -> str:
    told = f"<p>{escape(which)}</p>" if which else ""
    return (
        f'<section id="{ANIMATION}" aria-labelledby="{ANIMATION}-title">'
        f'<h2 id="{ANIMATION}-title">Animation</h2>{told}<div class="scene" data-content="{number}"></div></section>'
    )


# Blocks


def _block(block: Block, data: _Data) -> str:
    return _RENDERERS[type(block)](block, data)


def _text(block: Text, data: _Data) -> str:
    return f'<p class="small">{escape(block.text)}</p>' if block.small else f"<p>{escape(block.text)}</p>"


def _facts(block: Facts, data: _Data) -> str:
    entries = "".join(
        f"<div><dt>{escape(name)}</dt><dd>{_cell_content(cell)}</dd></div>" for name, cell in block.entries
    )
    return f'<dl class="{"cards" if block.large else "facts"}">{entries}</dl>'


def _checks(block: Checks, data: _Data) -> str:
    items = []
    for good, what, text in block.entries:
        symbol, kind, spoken = _SYMBOLS[good]
        items.append(
            f'<li class="{kind}"><span class="symbol" role="img" aria-label="{spoken}">{symbol}</span>'
            f"<span><b>{escape(what)}</b> {escape(text)}</span></li>"
        )
    return f'<ul class="checks">{"".join(items)}</ul>'


def _table(block: Table, data: _Data) -> str:
    columns = "".join(
        f'<th scope="col"{_kind(index - 1 in block.text_columns or index == 0, "words")}>{escape(heading)}</th>'
        for index, heading in enumerate(block.headings)
    )
    bodies = "".join(f"<tbody>{''.join(_row(row, block) for row in group)}</tbody>" for group in _groups(block.rows))
    note = f'<p class="small">{escape(block.note)}</p>' if block.note else ""
    kind = "table long" if len(block.rows) > _LONG else "table"
    return (
        f'<figure class="{kind}"><div class="box" tabindex="0" role="region" aria-label="{escape(block.caption)}">'
        f"<table><caption>{escape(block.caption)}</caption><thead><tr>{columns}</tr></thead>{bodies}</table></div>"
        f"{note}</figure>"
    )


def _groups(rows: Sequence[Row]) -> Iterator[list[Row]]:
    """Rows by groups, each of which begins with a leading row."""
    group: list[Row] = []
    for row in rows:
        if row.lead and group:
            yield group
            group = []
        group.append(row)
    if group:
        yield group


def _row(row: Row, table: Table) -> str:
    cells = "".join(_table_cell(cell, index in table.text_columns) for index, cell in enumerate(row.cells))
    return f'<tr><th scope="row">{_cell_content(_as_cell(row.heading))}</th>{cells}</tr>'


def _table_cell(cell: str | Cell, words: bool) -> str:
    cell = _as_cell(cell)
    kinds = " ".join(
        kind for kind, there in (("words", words), ("bar", cell.share >= 0.0), (cell.tone, cell.tone)) if there
    )
    style = f' style="--share:{min(cell.share, 1.0):.4f}"' if cell.share >= 0.0 else ""
    return f"<td{_kind(bool(kinds), kinds)}{style}>{_cell_content(cell)}</td>"


def _as_cell(cell: str | Cell) -> Cell:
    return cell if isinstance(cell, Cell) else Cell(text=cell)


def _cell_content(cell: Cell) -> str:
    text = escape(cell.text)
    if cell.hint:
        text = f'<span title="{escape(cell.hint)}">{text}</span>'
    return text + (f'<span class="below">{escape(cell.below)}</span>' if cell.below else "")


def _kind(wanted: bool, names: str) -> str:
    return f' class="{names}"' if wanted else ""


def _chart(block: Chart, data: _Data) -> str:
    number = data.place({"title": block.title, **block.content})
    caption = f'<p class="small">{escape(block.caption)}</p>' if block.caption else ""
    return (
        f'<figure class="chart {block.kind}" data-kind="{block.kind}" data-content="{number}">'
        f"<figcaption>{escape(block.title)}</figcaption>"
        f'<div class="drawing" role="group" aria-label="{escape(block.title or block.kind)}"></div>{caption}</figure>'
    )


def _drawing(block: Drawing, data: _Data) -> str:
    caption = f'<p class="small">{escape(block.caption)}</p>' if block.caption else ""
    return f'<figure class="drawing"><figcaption>{escape(block.title)}</figcaption>{block.svg}{caption}</figure>'


def _grid(block: Grid, data: _Data) -> str:
    return f'<div class="grid">{"".join(_block(each, data) for each in block.blocks)}</div>'


def _fold(block: Fold, data: _Data) -> str:
    blocks = "".join(_block(each, data) for each in block.blocks)
    return f"<details><summary>{escape(block.summary)}</summary>{blocks}</details>"


def _verbatim(block: Verbatim, data: _Data) -> str:
    return f'<pre tabindex="0">{escape(block.text)}</pre>'


_RENDERERS: dict[type, Callable[[Any, _Data], str]] = {
    Text: _text,
    Facts: _facts,
    Checks: _checks,
    Table: _table,
    Chart: _chart,
    Drawing: _drawing,
    Grid: _grid,
    Fold: _fold,
    Verbatim: _verbatim,
}
