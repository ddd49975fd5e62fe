"""What a TOML file says of its keys in comments: `typical_tlp.toml` explains every key of a scenario, once.

A key's comment is the one behind it, with the indented comment lines below, after the block of comment lines directly
above it. A key that is commented out (`# seed = 7   # of the waves alone`) has the comment behind it. A table's comment
is the block directly above its header. A block with an empty line below it is about no key.
"""

import re
from collections.abc import Mapping

KeyPath = tuple[str, ...]

_HEADER = re.compile(r"\[+(?P<path>[\w.-]+)\]+")
_KEY = re.compile(r"(?P<off># )?(?P<key>\w+) = (?P<rest>.*)")
_BEHIND = re.compile(r"""(?:[^#"]|"[^"]*")*?\s+#\s(?P<text>.*)""")


def key_comments(text: str) -> Mapping[KeyPath, str]:
    """Comment of each key and table of a TOML file that has one, by its path; line breaks become spaces."""
    found: dict[KeyPath, str] = {}
    table: KeyPath = ()
    block: list[str] = []
    last: KeyPath | None = None
    for line in text.splitlines():
        header, key = _HEADER.fullmatch(line.strip()), _KEY.fullmatch(line)
        if header:
            table = last = tuple(header["path"].split("."))
            block = _told(found, last, block)
        elif key and (behind := _BEHIND.fullmatch(key["rest"])):
            last = (*table, key["key"])
            # What stands above a key that is commented out is an example of something else.
            block = _told(found, last, [behind["text"]] if key["off"] else [*block, behind["text"]])
        elif key and not key["off"]:
            last = (*table, key["key"])
            block = _told(found, last, block)
        elif line.startswith("#"):
            block.append(line.removeprefix("#").strip())
        elif line.strip().startswith("#") and last:
            found[last] = f"{found.get(last, '')} {line.strip().removeprefix('#').strip()}".strip()
        else:
            block, last = [], None
    return found


def _told(found: dict[KeyPath, str], path: KeyPath, words: list[str]) -> list[str]:
    """Note the words of a key, and begin the next block."""
    if words:
        found[path] = " ".join(words)
    return []
