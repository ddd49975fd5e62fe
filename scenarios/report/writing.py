"""From results files to a file with their report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.whole_file import whole_file
from tlpsim.scenarios.generic import seconds
from tlpsim.scenarios.results import open_results


def write_report(files: Sequence[Path], output: Path, *, start: str | None = None, signals: Sequence[str] = ()) -> int:
    """Write the report of results files, and return its size in bytes.

    Parameters
    ----------
    files
        Results, complete or not.
    output
        Page; it is there when it is complete.
    start
        Time before which samples are left out of statistics, as "600" or "10min"; that of the scenario without it.
    signals
        Patterns of the signals whose time series are shown at first.

    Raises
    ------
    ResultsError
        When a file is not one of results, is given twice, or holds no samples.
    ScenarioError
        When the page cannot be written, `start` is no time, or a pattern matches no signal.
    """
    if output.is_dir():
        raise ScenarioError(f"{output}: is a folder; give the name of a file")
    if not output.parent.is_dir():
        raise ScenarioError(f"{output}: there is no folder {output.parent}; make it, or name another file")
    begin = None if start is None else seconds(start, "--from")
    if begin is not None and begin < 0.0:
        raise ScenarioError(f"--from {start}: must be 0 s or more")
    results = [open_results(path) for path in files]
    from tlpsim.scenarios.report.content import report_document
    from tlpsim.scenarios.report.page import page

    with whole_file(output, "the report") as part:
        part.touch()  # a folder that cannot be written to is told before anything is computed
        content = page(report_document(results, begin, signals)).encode()
        part.write_bytes(content)
    return len(content)
