"""What a report is made of: sections of blocks, as pure data without a word of HTML.

`tlpsim.scenarios.report.content` makes them of results and `tlpsim.scenarios.report.page` sets them as a page. All
texts are plain; the page escapes them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """A cell of a table.

    Attributes
    ----------
    text
        What it says.
    below
        In a second line, small: an interval, say.
    hint
        Shown in full where the pointer rests on it.
    share
        Length of a bar behind the text, of 1; negative for none.
    tone
        "good", "attention" or "" for how it is marked.
    """

    text: str
    below: str = ""
    hint: str = ""
    share: float = -1.0
    tone: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A row of a table: its heading, and its cells; `lead` for the first one of a group of rows."""

    heading: str | Cell
    cells: tuple[str | Cell, ...]
    lead: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table with a heading for each column, the first of which is that of the rows' headings.

    `text_columns` are those whose cells are words, counted from 0 beyond the headings; others are set as numbers.
    """

    caption: str
    headings: tuple[str, ...]
    rows: tuple[Row, ...]
    note: str = ""
    text_columns: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Text:
    """A paragraph; `small` for a remark."""

    text: str
    small: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """Names with values, as cards (`large`) or as a list; the cells' second lines are details."""

    entries: tuple[tuple[str, Cell], ...]
    large: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Checks:
    """Findings, each with whether it is good (None where it cannot be told) and what it says."""

    entries: tuple[tuple[bool | None, str, str], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Chart:
    """A figure that a script draws.

    Attributes
    ----------
    kind
        "series", "lines" or a figure of a sweep, see the scripts of each kind in `tlpsim.scenarios.report.page`.
    title
        Above the figure, and its name to those who cannot see it.
    content
        What the script takes, as JSON can hold it.
    caption
        Where it is from, and what it says.
    """

    kind: str
    title: str
    content: Mapping[str, Any]
    caption: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawing:
    """A figure of points and lines, in a plane with equal scales; see `tlpsim.scenarios.report.drawing`."""

    title: str
    svg: str
    caption: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Blocks beside each other where there is room."""

    blocks: tuple[Block, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Fold:
    """Blocks that are shown when asked for."""

    summary: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Verbatim:
    """Text in lines of its own, as it is."""

    text: str


Block = Table | Text | Facts | Checks | Chart | Drawing | Grid | Fold | Verbatim


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """A section of the page; `anchor` is the name of its place."""

    anchor: str
    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Document:
    """A whole report.

    Attributes
    ----------
    title, subtitle
        Of the page.
    status, complete
        What is said of the run, and whether it went to its end.
    head
        Blocks before the first section.
    sections
        In their order; those without blocks are left out of the page.
    scene
        Of the animation, see `tlpsim.scenarios.report.scene`; None for none.
    scene_of
        Which of several records it shows, "" of one.
    kind
        What the page is, above its title.
    """

    title: str
    subtitle: str
    status: str
    complete: bool
    head: tuple[Block, ...]
    sections: tuple[Section, ...]
    scene: Mapping[str, Any] | None = None
    scene_of: str = ""
    kind: str = "report of a run"
