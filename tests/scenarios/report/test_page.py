"""The page as text: nothing in it is taken for HTML that came from a file, and nothing outside of it is asked for."""

import base64
import dataclasses
import hashlib
import json
import re
from html.parser import HTMLParser

import pytest

from tlpsim.scenarios.report.document import (
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
from tlpsim.scenarios.report.page import page

BAD = "</script><script>alert('&amp;\"')</script><!-- <img src=x onerror=alert(1)>"
VOID = {"meta", "input", "br", "img", "link", "hr"}


class Parsed(HTMLParser):
    """Elements of a page with their attributes and texts; fails where they do not close in order."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[str, list[str]] = {}
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attributes)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attributes)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open:
            self.texts.setdefault(self.open[-1], []).append(data)

    def of(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.elements if name == tag]


def hostile() -> Document:
    """A document of every block, with the same bad text everywhere."""
    packed = {"count": 2, "offset": 0.0, "scale": 1.0, "differences": 0, "data": "AAAA"}
    chart = Chart(kind="lines", title=BAD, content={"label": BAD, "x": float("nan"), "a": packed, "b": dict(packed)})
    cell = Cell(text=BAD, below=BAD, hint=BAD, share=0.5, tone="good")
    table = Table(caption=BAD, headings=(BAD, BAD), rows=(Row(heading=cell, cells=(cell,)),), note=BAD)
    blocks = (
        Text(text=BAD),
        Facts(entries=((BAD, cell),)),
        Checks(entries=((True, BAD, BAD), (None, BAD, BAD), (False, BAD, BAD))),
        Grid(blocks=(table, chart)),
        Drawing(title=BAD, svg="<svg viewBox='0 0 1 1'></svg>", caption=BAD),
        Fold(summary=BAD, blocks=(Verbatim(text=BAD),)),
    )
    sections = (Section(anchor="a", title=BAD, blocks=blocks), Section(anchor="empty", title="Empty", blocks=()))
    return Document(
        title=BAD, subtitle=BAD, status=BAD, complete=False, head=blocks[:2], sections=sections, scene={"name": BAD}
    )


@pytest.fixture(scope="module")
def made() -> str:
    return page(hostile())


def test_no_text_becomes_markup(made: str) -> None:
    found = Parsed(made)
    assert "alert('" not in "".join(found.texts["script"]).replace(json.dumps(BAD)[1:-1].replace("<", "\\u003c"), "")
    assert not found.of("img")
    assert BAD in found.texts["title"]
    assert BAD in found.texts["h1"]
    assert BAD in "".join(found.texts["pre"])
    assert not [each for _, attributes in found.elements for each in attributes if each.startswith("on")]


def test_the_data_are_read_back_with_each_array_once(made: str) -> None:
    found = Parsed(made)
    (data,) = [text for text in found.texts["script"] if text.startswith('{"contents"')]
    read = json.loads(data)
    chart = next(each for each in read["contents"] if "label" in each)
    assert chart["label"] == BAD
    assert chart["x"] is None
    assert chart["a"]["data"] == chart["b"]["data"] == 0
    assert read["arrays"] == ["AAAA"]


def test_only_the_scripts_of_the_page_may_run(made: str) -> None:
    found = Parsed(made)
    policy = next(each["content"] for each in found.of("meta") if each.get("http-equiv") == "Content-Security-Policy")
    assert policy is not None
    assert "default-src 'none'" in policy
    assert "'unsafe-inline'" not in policy.partition("script-src")[2].partition(";")[0]
    allowed = set(re.findall(r"'sha256-([^']+)'", policy))
    scripts = [text for text in found.texts["script"] if not text.startswith('{"contents"')]
    digests = {base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in scripts}
    assert digests == allowed


def test_nothing_outside_is_named(made: str) -> None:
    found = Parsed(made)
    assert not [a for _, a in found.elements if {"src", "srcset", "data", "action"} & set(a)]
    links = [attributes.get("href") or "" for attributes in (*found.of("a"), *found.of("link"))]
    assert all(each.startswith("#") for each in links)
    assert "url(" not in "".join(found.texts["style"])
    assert "@import" not in "".join(found.texts["style"])


def test_contents_name_the_sections_that_are_there(made: str) -> None:
    found = Parsed(made)
    anchors = {(each.get("href") or "")[1:] for each in found.of("a")} - {"main"}
    assert anchors == {"a", "animation"} == {each["id"] for each in found.of("section")}
    assert len({each["id"] for _, each in found.elements if "id" in each}) == sum(
        "id" in each for _, each in found.elements
    )


def test_tables_name_their_headings(made: str) -> None:
    found = Parsed(made)
    assert all(each.get("scope") in ("col", "row") for each in found.of("th"))
    assert len(found.of("caption")) == len(found.of("table"))
    assert all(each.get("aria-label") for each in found.of("div") if each.get("role"))


def test_without_a_scene_its_scripts_are_left_out(made: str) -> None:
    without = page(dataclasses.replace(hostile(), scene=None))
    assert len(without) < 0.7 * len(made)
    assert "animation" not in {each.get("id") for each in Parsed(without).of("section")}
