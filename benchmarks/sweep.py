"""Sweeps: what scheduling costs, one worker against two, a thousand cases, kills, a second host.

python benchmarks/sweep.py [--quick] [--json docs/data/sweep.json]

The second host is a network namespace with a folder and a cache of its own; it needs root and `ip`, and is left out
without.
"""

from __future__ import annotations

import hashlib
import os
import random
import resource
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from report import Row, at_least, at_most, main

from tlpsim.scenarios.sweep import execution
from tlpsim.scenarios.sweep.execution import run_sweep
from tlpsim.scenarios.sweep.job import Order, Outcome
from tlpsim.scenarios.sweep.plan import Sweep
from tlpsim.scenarios.sweep.prepared import Prepared
from tlpsim.scenarios.sweep.table import NAME

PROGRAM = [sys.executable, "-m", "tlpsim.scenarios.cli"]
DASK = [str(Path(sys.executable).with_name("dask"))]
HERE = Path(__file__).parent
SCATTER = HERE.parent / "scenarios" / "sweeps" / "north_sea.toml"
_NAMES = tuple(f"platform.tendon_tension[{k}].{statistic}" for k in range(18) for statistic in "abcdefghijk")


def nothing(order: Order, *prepared: Prepared) -> Outcome:
    """A job that takes no time, and leaves as many numbers as one of the frequency domain."""
    return Outcome(key=order.key, names=_NAMES, units=("N",) * len(_NAMES), values=np.zeros(len(_NAMES)), seconds=0.0)


def _heights(count: int, **rest: Any) -> Sweep:
    axis = {"from": 2.0, "to": 9.0, "count": count}
    return Sweep.from_dict({"grid": {"waves.significant_height": axis}, "files": [], **rest})


@contextmanager
def _folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="sweep-") as name:
        yield Path(name)


class _Clock:
    """When the first and the last job of a sweep were done, as its progress says."""

    def __init__(self) -> None:
        self.began = time.perf_counter()
        self.seen: list[tuple[float, int]] = []

    def __call__(self, done: int, total: int, failed: int) -> None:
        self.seen.append((time.perf_counter() - self.began, done))

    def seconds_a_job(self, skipped: int) -> float:
        """From the moment at which so many were done."""
        first = next(each for each in self.seen if each[1] >= skipped)
        last = self.seen[-1]
        return (last[0] - first[0]) / (last[1] - first[1])


def _cpu() -> float:
    usage = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in usage)


def overhead(quick: bool) -> Sequence[Row]:
    """Jobs that do nothing, through plan, scheduler, ledger and summary."""
    count = 500 if quick else 5000
    real, execution.perform = execution.perform, nothing
    try:
        with _folder() as folder:
            sweep, clock, cpu = _heights(count), _Clock(), _cpu()
            run_sweep(sweep, folder / "s", workers=2, progress=clock)
            whole, cpu = time.perf_counter() - clock.began, _cpu() - cpu
            again = time.perf_counter()
            run_sweep(sweep, folder / "s", workers=2)
            again = time.perf_counter() - again
            size = sum(each.stat().st_size for each in (folder / "s").iterdir())
    finally:
        execution.perform = real
    return [
        at_most(f"scheduling of a job, of {count} that do nothing", 1e3 * clock.seconds_a_job(2), 5.0, "ms"),
        Row(
            item="the same: whole sweep, with the start of its cluster",
            measured=f"{1e3 * whole / count:.2f} ms a job",
        ),
        Row(item="the same: processor time of all processes", measured=f"{1e3 * cpu / count:.2f} ms a job"),
        Row(item="the same again, all of it done before", measured=f"{1e3 * again / count:.2f} ms a job"),
        Row(item="ledger and summary", measured=f"{size / count / 1e3:.1f} kB a job"),
    ]


def scaling(quick: bool) -> Sequence[Row]:
    """The same sweep by one worker and by two, in turn."""
    counts = {"frequency": 16 if quick else 80, "time": 4 if quick else 16}
    rows = []
    for domain, count in counts.items():
        times: dict[int, list[float]] = {1: [], 2: []}
        for turn in range(1 if quick else 3):
            for workers in (1, 2) if turn % 2 == 0 else (2, 1):
                sweep = _heights(
                    count, domains=[domain], time={"engine": "cosimulation"}, set={"simulation": {"duration": 3600}}
                )
                clock = _Clock()
                with _folder() as folder:
                    run_sweep(sweep, folder / "s", workers=workers, progress=clock)
                times[workers].append(clock.seconds_a_job(2 * workers))
        one, two = (statistics.median(times[workers]) for workers in (1, 2))
        rows.append(at_least(f"two workers over one, {domain} domain, {count} jobs", one / two, 1.8, "×"))
        rows.append(Row(item="the same: a job by one; by two", measured=f"{one:.3f}; {two:.3f} s"))
    return rows


def thousand(quick: bool) -> Sequence[Row]:
    """A thousand cases of the frequency domain on two cores: heights, periods and headings."""
    count = 4 if quick else 10
    sweep = Sweep.from_dict(
        {
            "title": "a thousand cases",
            "grid": {
                "waves.significant_height": {"from": 2.0, "to": 11.0, "count": count},
                "waves.peak_period": {"from": 8.0, "to": 17.0, "count": count},
                "waves.heading_deg": {"from": 0.0, "to": 45.0, "count": count},
            },
            "linked": {"wind.speed": {"by": "waves.significant_height", "at": [2.0, 11.0], "value": [8.0, 24.0]}},
        }
    )
    with _folder() as folder:
        clock = _Clock()
        table = run_sweep(sweep, folder / "s", workers=2, progress=clock)
        whole = time.perf_counter() - clock.began
        size = sum(each.stat().st_size for each in (folder / "s").rglob("*.h5"))
    bound = 180.0 * table.rows / 1000.0
    return [
        at_most(f"{table.rows} cases of the frequency domain, two workers, files and all", whole, bound, "s"),
        Row(item="the same: failed cases", measured=f"{table.failed}", bound="0", ok=table.failed == 0),
        Row(item="the same: a results file", measured=f"{size / table.rows / 1e6:.2f} MB"),
    ]


# Kills

_KILLED = """
title = "kills"
domains = ["frequency", "time"]
files = []
[set]
simulation.duration = 600
[grid]
waves.significant_height = {{ from = 3, to = 8, count = {count} }}
waves.heading_deg = [0, 45]
[replicates]
records = 2
[time]
engine = "monolithic"
"""


def _digest(folder: Path) -> str:
    return hashlib.sha256((folder / NAME).read_bytes()).hexdigest()


def _sweep(file: Path, folder: Path, *options: str, **more: Any) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [*PROGRAM, "sweep", str(file), "-o", str(folder), "-q", *options],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        **more,
    )


def _children(process: int) -> list[int]:
    """Processes below one, of all generations."""
    found = subprocess.run(["ps", "-e", "-o", "pid=,ppid="], capture_output=True, text=True, check=True).stdout
    parents = {int(pid): int(parent) for pid, parent in (line.split() for line in found.splitlines())}
    below, ring = [], [process]
    while ring:
        ring = [pid for pid, parent in parents.items() if parent in ring]
        below += ring
    return below


def _workers(process: int) -> list[int]:
    """Worker processes below one."""
    found = []
    for pid in _children(process):
        try:
            command = Path(f"/proc/{pid}/cmdline").read_bytes()
        except OSError:
            continue
        if b"spawn_main" in command:
            found.append(pid)
    return found


class _Cluster:
    """A scheduler at a port of this host with workers, to be killed."""

    def __init__(self, port: int) -> None:
        self.address = f"tcp://127.0.0.1:{port}"
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.scheduler = subprocess.Popen(
            [*DASK, "scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"], **quiet
        )
        self.workers = subprocess.Popen(
            [*DASK, "worker", self.address, "--nworkers", "2", "--nthreads", "1", "--no-dashboard"], **quiet
        )
        time.sleep(4.0)

    def close(self) -> None:
        for process in (self.workers, self.scheduler):
            for pid in (*_children(process.pid), process.pid):
                _kill(pid)
            process.wait()


def _kill(pid: int) -> None:
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)


def kills(quick: bool) -> Sequence[Row]:
    """SIGKILL of a worker, of the client and of the scheduler at random moments; then the same command again."""
    rounds = 1 if quick else 5
    chance = random.Random(9)
    rows = []
    with _folder() as folder:
        file = folder / "kills.toml"
        file.write_text(_KILLED.format(count=4 if quick else 8))
        began = time.perf_counter()
        _require(_sweep(file, folder / "whole").wait() == 0, "the undisturbed sweep")
        seconds = time.perf_counter() - began
        expected = _digest(folder / "whole")
        for what, disturbed in _DISTURBED.items():
            equal = struck = 0
            for turn in range(rounds):
                place = folder / f"{what}{turn}"
                struck += disturbed(file, place, lambda: chance.uniform(0.05, 0.9) * seconds)
                equal += _digest(place) == expected
                shutil.rmtree(place)
            rows.append(
                Row(
                    item=f"SIGKILL of {what}, {struck} in {rounds} sweeps: summaries equal bit for bit",
                    measured=f"{equal} of {rounds}",
                    bound=f"{rounds} of {rounds}",
                    ok=equal == rounds,
                )
            )
    return rows


def _require(good: bool, what: str) -> None:
    if not good:
        raise SystemExit(f"benchmarks/sweep.py: {what} did not end well")


def _worker_dies(file: Path, place: Path, moment: Callable[[], float]) -> int:
    process, struck = _sweep(file, place), 0
    for wait in sorted((moment(), moment())):
        time.sleep(0.5 * wait)
        found = _workers(process.pid)
        if found and process.poll() is None:
            _kill(found[int(1000 * wait) % len(found)])
            struck += 1
    _require(process.wait() == 0, "a sweep that lost a worker")
    return struck


def _client_dies(file: Path, place: Path, moment: Callable[[], float]) -> int:
    struck = 0
    for _ in range(2):
        process = _sweep(file, place)
        try:
            process.wait(moment())
        except subprocess.TimeoutExpired:
            _kill(process.pid)
            process.wait()
            struck += 1
    time.sleep(1.0)
    _require(_sweep(file, place).wait() == 0, "a sweep that was resumed")
    return struck


def _scheduler_dies(file: Path, place: Path, moment: Callable[[], float]) -> int:
    struck = 0
    port = random.Random(str(place)).randrange(20000, 30000)
    for last in (False, True):
        cluster = _Cluster(port)
        process = _sweep(file, place, "--scheduler", cluster.address)
        try:
            if not last:
                try:
                    process.wait(moment())
                except subprocess.TimeoutExpired:
                    _kill(cluster.scheduler.pid)
                    struck += 1
            code = process.wait(120)
            _require(code == 0 or (struck and not last and code == 2), "a sweep whose scheduler died")
        finally:
            cluster.close()
        port += 1
    return struck


_DISTURBED: Mapping[str, Callable[[Path, Path, Callable[[], float]], int]] = {
    "a worker": _worker_dies,
    "the client": _client_dies,
    "the scheduler": _scheduler_dies,
}


# Second host


def second_host(quick: bool) -> Sequence[Row]:
    """Workers in a network namespace, which see neither the sweep's folder nor this user's cache."""
    if os.geteuid() != 0 or shutil.which("ip") is None:
        return [Row(item="a second host", measured="left out: needs root and ip")]
    with _folder() as folder, _namespace() as (name, own, _):
        file = folder / "hosts.toml"
        file.write_text(_KILLED.format(count=3).replace("files = []", ""))
        _require(_sweep(file, folder / "here").wait() == 0, "the sweep on this host")
        # The commands of docs/sweeps.md, with the worker's inside the namespace; a tmpfs hides the sweep's folder.
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        scheduler = subprocess.Popen([*DASK, "scheduler", "--host", own, "--port", "8786", "--no-dashboard"], **quiet)
        hidden = f"mount -t tmpfs none {folder} && exec "
        worker = [*DASK, "worker", f"tcp://{own}:8786", "--nworkers", "2", "--nthreads", "1", "--no-dashboard"]
        command = hidden + " ".join(worker)
        with tempfile.TemporaryDirectory() as cache:
            there = subprocess.Popen(
                ["ip", "netns", "exec", name, "unshare", "--mount", "sh", "-c", command],
                env={**os.environ, "XDG_CACHE_HOME": cache},
                cwd="/",
                **quiet,
            )
            try:
                time.sleep(5.0)
                process = _sweep(file, folder / "there", "--scheduler", f"tcp://{own}:8786")
                _require(process.wait() == 0, "the sweep on the second host")
                databases = len(list(Path(cache).rglob("bem/*.h5")))
            finally:
                for each in (there, scheduler):
                    for pid in (*_children(each.pid), each.pid):
                        _kill(pid)
                    each.wait()
        files = [len(list((folder / place).rglob("cases/*/*.h5"))) for place in ("here", "there")]
        same = _digest(folder / "here") == _digest(folder / "there")
    return [
        Row(item="summary by workers of a second host, equal bit for bit", measured=str(same), bound="True", ok=same),
        Row(
            item="results files from there; hydrodynamics sent there",
            measured=f"{files[1]}; {databases}",
            bound=f"{files[0]}; 1",
            ok=files[0] == files[1] > 0 and databases == 1,
        ),
    ]


@contextmanager
def _namespace() -> Iterator[tuple[str, str, str]]:
    """A network namespace with an address, joined to this host; its name, this host's address, its own."""
    name, own, other = "tlpsim-second", "10.77.31.1", "10.77.31.2"
    commands = (
        f"ip netns add {name}",
        f"ip link add tlpsim0 type veth peer name tlpsim1 netns {name}",
        f"ip addr add {own}/24 dev tlpsim0",
        "ip link set tlpsim0 up",
        f"ip -n {name} addr add {other}/24 dev tlpsim1",
        f"ip -n {name} link set tlpsim1 up",
        f"ip -n {name} link set lo up",
    )
    try:
        for command in commands:
            subprocess.run(command.split(), check=True)
        yield name, own, other
    finally:
        subprocess.run(["ip", "netns", "del", name], check=False)
        subprocess.run(["ip", "link", "del", "tlpsim0"], check=False, stderr=subprocess.DEVNULL)


if __name__ == "__main__":
    main("Sweeps", [overhead, scaling, thousand, kills, second_host])
