"""The command `tlpsim schema`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tlpsim.scenarios.terminal import say


def schema(
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Write it to a file, not to the terminal.")
    ] = None,
) -> None:
    """Print the JSON Schema of a scenario file, with which editors complete and check its keys.

    A scenario names it in its first line: #:schema scenario.schema.json
    """
    from tlpsim.loads.whole_file import whole_file
    from tlpsim.scenarios.json_schema import scenario_schema
    from tlpsim.scenarios.json_text import json_text

    text = json_text(scenario_schema())
    if output is None:
        typer.echo(text)
        return
    with whole_file(output, "the schema") as part:
        part.write_text(text + "\n", encoding="utf-8")
    say(f"schema: {output}")
