"""What a run leaves: the results file, its readers, kills, the report in a browser, statistics and their intervals.

python benchmarks/results.py [--quick]
"""

from __future__ import annotations

import random
import shutil
import signal
import statistics
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import h5py
import numpy as np
import results_browser
import statistics_accuracy
import xarray
from report import Row, at_most, main

from tlpsim.orchestrator.clock import to_ticks
from tlpsim.orchestrator.execution import run
from tlpsim.scenarios import results
from tlpsim.scenarios.assemble import assembled
from tlpsim.scenarios.report.writing import write_report
from tlpsim.scenarios.results_writer import ResultsWriter
from tlpsim.scenarios.schema import Scenario

SCENARIO = Path(__file__).parent.parent / "scenarios" / "typical_tlp.toml"
FINE = ["components.wind.step=0.1", "components.wave.step=0.1"]
KILLS = 20
_SECONDS = 20.0  # for which a run that is to be killed goes on at least


def _wall_time(scenario: Scenario, path: Path | None) -> float:
    """Wall time in s of a run without the loading of its FMUs; with a results file, until that is whole."""
    with assembled(scenario) as assembly:
        observers = [] if path is None else [ResultsWriter(path, scenario)]
        began = time.perf_counter()
        run(assembly.system, to_ticks(scenario.simulation.duration, "duration"), observers=observers)
        return time.perf_counter() - began


def writing(quick: bool) -> Sequence[Row]:
    """What writing adds to the run; the two are run in turn, and the medians are compared."""
    rows = []
    for name, settings in (("all signals at 0.1 s", FINE), ("the default steps", [])):
        scenario = Scenario.load(SCENARIO, [*settings, f"simulation.duration={'0.5h' if quick else '3h'}"])
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "r.h5"
            pairs = [(_wall_time(scenario, None), _wall_time(scenario, path)) for _ in range(2 if quick else 3)]
            bare, written = (statistics.median(column) for column in zip(*pairs, strict=True))
            size, raw = path.stat().st_size, _raw_size(path)
        share = 100.0 * (written - bare) / written
        rows.append(at_most(f"{scenario.simulation.duration / 3600:g} h, {name}: share of writing", share, 10.0, "%"))
        rows.append(Row(item="the same: run with writing", measured=f"{written:.2f} s"))
        rows.append(
            Row(item="the same: file; compressed to", measured=f"{size / 1e6:.1f} MB; {100 * size / raw:.0f} %")
        )
    return rows


def _raw_size(path: Path) -> int:
    with h5py.File(path) as file:
        return sum(dataset.size * dataset.dtype.itemsize for group in file.values() for dataset in group.values())


def readers(quick: bool) -> Sequence[Row]:
    """xarray, h5py and h5dump on one file."""
    scenario = Scenario.load(SCENARIO, [f"simulation.duration={'0.5h' if quick else '3h'}"])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "r.h5"
        scenario.run(path)
        began = time.perf_counter()
        with results.open(path) as data:
            opened = time.perf_counter() - began
            loaded = sum(each.variable._in_memory for each in data.data_vars.values())
            surge = data["platform.position.surge"].values
        with h5py.File(path) as file:
            same = np.array_equal(file["platform/position.surge"], surge)
        with xarray.open_dataset(path, group="platform", engine="h5netcdf") as part:
            same = same and np.array_equal(part["position.surge"], surge)
        rows = [
            Row(item="xarray and h5py read the same bits", measured=str(same), bound="True", ok=bool(same)),
            Row(item="signals in memory after opening by xarray", measured=f"{loaded}", bound="0", ok=loaded == 0),
            Row(item="opening by xarray", measured=f"{opened:.2f} s"),
        ]
        return [*rows, _h5dump(path, float(surge[-1]))]


def _h5dump(path: Path, last: float) -> Row:
    item = "h5dump prints the last sample"
    if shutil.which("h5dump") is None:
        return Row(item=item, measured="h5dump is not installed")
    count = len(results.open_results(path).time("platform"))
    command = ["h5dump", "-m", "%.17g", "-y", "-d", "/platform/position.surge", "-s", f"{count - 1}", "-c", "1", path]
    text = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    number = float(text.partition("DATA {")[2].partition("}")[0])
    return Row(item=item, measured=f"{number:.17g}", bound=f"{last:.17g}", ok=number == last)


VICTIM = """
import os, struct, sys, time
from tlpsim.orchestrator.observers import Observer
from tlpsim.scenarios.schema import Scenario

class Teller(Observer):
    def sampled(self, index, times, values):
        if index == 2:
            os.pwrite(told, struct.pack("<dd", time.monotonic(), times[-1] / 1e9), 0)

told = os.open(sys.argv[2], os.O_RDWR | os.O_CREAT)
scenario = Scenario.load(sys.argv[3], ["simulation.duration=400h"])
scenario.run(sys.argv[1], observers=[Teller()])
"""


def kills(quick: bool) -> Sequence[Row]:
    """SIGKILL at random moments: the file opens by all readers, and how many seconds of the run are lost."""
    chance, lost, unread = random.Random(8), [], 0
    count = 4 if quick else KILLS
    for _ in range(count):
        with tempfile.TemporaryDirectory() as folder:
            path, told = Path(folder) / "r.h5", Path(folder) / "told"
            process = subprocess.Popen([sys.executable, "-c", VICTIM, path, told, SCENARIO])
            while not told.exists() or told.stat().st_size < 16:
                time.sleep(0.01)
            _, first = struct.unpack("<dd", told.read_bytes())
            began = time.monotonic()
            time.sleep(chance.uniform(0.5, 6.0))
            process.send_signal(signal.SIGKILL)
            process.wait()
            moment, reached = struct.unpack("<dd", told.read_bytes())
            part = Path(f"{path}.part")
            try:
                kept = _last_time(part)
            except Exception as error:
                print(f"a killed run cannot be read: {error}", file=sys.stderr)
                unread += 1
                continue
            lost.append((reached - kept) * (moment - began) / max(reached - first, 1e-9))
    return [
        at_most(f"SIGKILL at {count} random moments: files that do not open", unread, 0),
        at_most("the same: wall time of the run that is lost, at most", max(lost), 3.0, "s"),
        Row(item="the same: median", measured=f"{statistics.median(lost):.2f} s"),
    ]


def _last_time(part: Path) -> float:
    """Last time of the platform in a file, which is read whole by xarray, h5py and h5dump."""
    with results.open(part) as data:
        assert all(np.all(np.isfinite(each)) for each in data.data_vars.values())
        last = float(data["platform.time"][-1])
    with h5py.File(part) as file:
        assert len(file["platform/time"]) >= 1
    if shutil.which("h5dump"):
        subprocess.run(["h5dump", "-H", part], check=True, stdout=subprocess.DEVNULL)
    return last


def report_page(quick: bool) -> Sequence[Row]:
    """The report of one record of 3 hours with all signals at 0.1 s, and of three of the default steps."""
    hours = "0.5h" if quick else "3h"
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        fine = Path(folder) / "fine.h5"
        Scenario.load(SCENARIO, [*FINE, f"simulation.duration={hours}"]).run(fine)
        seeds = [Path(folder) / f"{seed}.h5" for seed in (1, 2, 3)]
        for seed, path in enumerate(seeds, start=1):
            Scenario.load(SCENARIO, [f"simulation.seed={seed}", f"simulation.duration={hours}"]).run(path)
        for name, files in ((f"{hours}, all signals at 0.1 s", [fine]), ("three records, default steps", seeds)):
            page = Path(folder) / "report.html"
            began = time.perf_counter()
            size = write_report(files, page)
            rows.append(at_most(f"report, {name}: made in", time.perf_counter() - began, 20.0, "s"))
            rows.append(at_most("the same: size", size / 1e6, 15.0, "MB"))
            rows += results_browser.rows(page)
    return rows


def intervals(quick: bool) -> Sequence[Row]:
    """Statistics against known answers."""
    return statistics_accuracy.rows(quick)


if __name__ == "__main__":
    main("Results", [writing, readers, kills, report_page, intervals])
