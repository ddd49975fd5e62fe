"""Code blocks of the documents: where they stand, what they are, and whether a test can run them.

A block may have a comment on the line before it, which no reader sees:

    <!-- long: REASON -->      it takes minutes: `pytest -m validation` runs it as it stands
    <!-- not run: REASON -->   no test can run it

and a file's name behind its language, ```toml title="mine.toml"```: then it is also written to that file, for the
blocks below it.
"""

import re
from dataclasses import dataclass
from pathlib import Path

_BLOCK = re.compile(
    r"(?:^<!-- (?P<mark>long|not run): *(?P<reason>.*?) *-->\n)?"
    r"^```(?P<language>\w*)(?P<attributes>[^\n`]*)\n(?P<text>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)
_MARK = re.compile(r"^<!-- *(?:long|not run)\b", re.MULTILINE)

RUN = ("sh", "python")
PARSED = ("toml", "json", "xml")
SHOWN = ("text", "console", "csv")


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """One code block: `mark` is "", "long" or "not run"; `file` is the name of the file that it is, or ""."""

    page: Path
    line: int
    language: str
    text: str
    file: str
    mark: str
    reason: str

    def __str__(self) -> str:
        return f"{self.page.name}:{self.line}"


def blocks(page: Path) -> list[Block]:
    """Blocks of a Markdown file in their order.

    Raises
    ------
    ValueError
        Where a block has no language, or one that is not known, or a mark has no reason or no block.
    """
    text = page.read_text(encoding="utf-8")
    found = []
    for each in _BLOCK.finditer(text):
        named = re.search(r'title="([^"]+)"', each["attributes"])
        block = Block(
            page=page,
            line=text.count("\n", 0, each.start("language")) + 1,
            language=each["language"],
            text=each["text"],
            file=named[1] if named else "",
            mark=each["mark"] or "",
            reason=each["reason"] or "",
        )
        if block.language not in RUN + PARSED + SHOWN:
            known = ", ".join(RUN + PARSED + SHOWN)
            raise ValueError(f"{block}: a block of '{block.language}'; give it one of the languages {known}")
        if block.mark and not block.reason:
            raise ValueError(f"{block}: '{block.mark}' without a reason")
        found.append(block)
    if len(_MARK.findall(text)) != sum(bool(block.mark) for block in found):
        raise ValueError(f"{page.name}: a comment 'long:' or 'not run:' that stands on no block")
    return found
