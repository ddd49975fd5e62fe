"""Damaged FMUs, system descriptions and scenarios, each made by a seed, and what becomes of them.

`trials` hands them one by one to a process of their own, in a folder of their own, as `tlpsim run` would. Whatever the
input, there are two good ends: a run, or a `TlpsimError` of one line. It is used by `tests/test_hostile_input.py` and
by `benchmarks/master.py`.
"""

import io
import json
import os
import queue
import random
import re
import subprocess
import sys
import threading
import time
import traceback
import zipfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO
from xml.etree import ElementTree

ROOT = Path(__file__).parent.parent.parent
KINDS = ("fmu2", "fmu3", "ssd", "ssp", "scenario")
RUN, REFUSED, FAULT = "run", "refused", "fault"
TIMEOUT = 60.0  # s, for one input
_LARGEST_RUN = 1.0  # s of wall time, after which a run counts as one
_NAMES = (
    "Ünïcode 名前",
    "a" * 5000,
    "../../../evil",
    "/etc/passwd",
    "%s%n%x",
    "a.b.c",
    "a[1]",
    "",
    " ",
    "\t\n",
    "time",
)
_NUMBERS = (
    *("-1", "0", "1e400", "-1e400", "nan", "inf", "1e308", "1e-320", "-0.0", "9" * 40, "2147483648", "4294967296"),
    *("18446744073709551616", "-9223372036854775809", "1,5", "0x10", "1_000", "１２", "1 2 3", "1e9", "3.7", "0.1"),
)
_WORDS = ("true", "false", "input", "output", "parameter", "local", "independent", "fixed", "constant", "2.0", "3.0")
_TEXTS = (*_NAMES, *_NUMBERS, *_WORDS)


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What became of one input: `end` is `RUN`, `REFUSED` or `FAULT`, and `message` the error or the fault."""

    kind: str
    seed: int
    end: str
    message: str


# Damage


def damaged_text(text: str, chance: random.Random, values: Sequence[str] = _TEXTS) -> str:
    """Text with a piece cut out, doubled, or replaced."""
    first = chance.randrange(len(text))
    last = min(len(text), first + chance.choice((1, 5, 50, 500)))
    piece = chance.choice(("", 2 * text[first:last], chance.choice(values)))
    return text[:first] + piece + text[last:]


def damaged_xml(text: str, chance: random.Random) -> bytes:
    """XML document with one to three faults: in attributes, in its elements, or in the text."""
    root = ElementTree.fromstring(text)
    faults: tuple[Callable[[ElementTree.Element, random.Random], None], ...] = (_attribute, _attribute, _element)
    for _ in range(chance.randint(1, 3)):
        chance.choice(faults)(root, chance)
    data = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    whole = chance.random()
    if whole < 0.05:
        entity = b'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]>'
        return data.replace(b"?>", b"?>" + entity, 1)
    if whole < 0.1:
        return damaged_text(data.decode(), chance).encode()
    if whole < 0.13:
        depth, (head, tag, tail) = chance.choice((3000, 100_000)), data.rpartition(b"</")
        return head + depth * b"<x>" + depth * b"</x>" + tag + tail
    if whole < 0.16:
        return data.decode().replace("utf-8", chance.choice(("utf-16", "latin-9", "cp65001", "klingon"))).encode()
    return damaged_bytes(data, chance) if whole < 0.2 else data


def _attribute(root: ElementTree.Element, chance: random.Random) -> None:
    """An attribute removed, renamed, swapped or with a hostile value."""
    element = chance.choice([each for each in root.iter() if each.attrib])
    name = chance.choice(list(element.attrib))
    match chance.randrange(6):
        case 0:
            del element.attrib[name]
        case 1:
            element.attrib[chance.choice(("x", name.upper(), "start", "valueReference"))] = element.attrib.pop(name)
        case 2:
            other = chance.choice([each for each in root.iter() if each.attrib])
            element.attrib[name] = chance.choice(list(other.attrib.values()))
        case _:
            element.attrib[name] = chance.choice(_TEXTS)


def _element(root: ElementTree.Element, chance: random.Random) -> None:
    """A child removed, doubled, moved, renamed, emptied, or buried deep."""
    parent = chance.choice([each for each in root.iter() if len(each)])
    child = chance.choice(list(parent))
    elsewhere = chance.choice(list(root.iter()))
    match chance.randrange(7):
        case 0:
            parent.remove(child)
        case 1:
            parent.append(child)
        case 2:
            children = list(parent)
            chance.shuffle(children)
            parent[:] = children
        case 3:
            child.tag = chance.choice([each.tag for each in root.iter()])
        case 4:
            child[:] = []
        case 5:
            if child not in elsewhere.iter() and elsewhere not in child.iter():
                parent.remove(child)
                elsewhere.append(child)
        case 6:
            for _ in range(chance.choice((3, 300))):
                inner = ElementTree.SubElement(parent, chance.choice((parent.tag, child.tag)), child.attrib)
                parent = inner


def damaged_bytes(data: bytes, chance: random.Random) -> bytes:
    """Bytes cut off, or a few of them changed."""
    if chance.random() < 0.3:
        return data[: chance.randrange(len(data))]
    changed = bytearray(data)
    for _ in range(chance.choice((1, 4, 40))):
        changed[chance.randrange(len(changed))] = chance.randrange(256)
    return bytes(changed)


def damaged_zip(members: dict[str, bytes], chance: random.Random) -> bytes:
    """Archive of members with a fault of its own, about one time in three."""
    file = io.BytesIO()
    fault = chance.randrange(18)
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
        name = chance.choice(("../evil", "../../evil", "/tmp/evil", "a/../../evil", "C:/evil", "..\\evil", "x" * 300))
        match fault:
            case 0 | 1:
                archive.writestr(name, b"out of the folder")
            case 2:
                link = zipfile.ZipInfo("resources")
                link.external_attr = 0o120777 << 16
                archive.writestr(link, "/")
                archive.writestr("resources/evil", b"through a link")
            case 3:
                archive.writestr("bomb", bytes(200 << 20))
            case 4:
                archive.writestr(f"{next(iter(members))}/inside", b"a file as a folder")
    data = file.getvalue()
    return damaged_bytes(data, chance) if fault in (5, 6) else data


def damaged_toml(text: str, chance: random.Random) -> str:
    """Scenario with one or two lines that are missing, doubled, in the wrong table, or have a hostile value."""
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    values = (
        *('""', '"nan"', "nan", "inf", "-inf", "-1", "0", "1", "1e300", "1e-300", "10000000", "9223372036854775807"),
        *("9" * 30, "true", "[]", "{}", "[[1]]", "[1, 2]", '["a"]', "{ a = { b = 1 } }", "1979-05-27", "'名前'"),
        *('"10 furlongs"', '"3 h"', '"../../evil.fmu"', '"builtin:nothing"', "0.1", "0.3", "1.5", "[1.0, nan]"),
        *("[" * 60 + "]" * 60, '"' + "a" * 5000 + '"', "{ from = 'a.b' }", "{ fmu = 'x.fmu', step = 0.1 }"),
    )
    for _ in range(chance.choice((1, 1, 2))):
        number = chance.randrange(len(lines))
        key, equals, _ = lines[number].partition("=")
        match chance.randrange(8):
            case 0:
                del lines[number]
            case 1:
                lines.insert(chance.randrange(len(lines)), lines[number])
            case 2:
                lines[number] = chance.choice(("x", "seed", "step", "名", '"a.b.c"')) + " = 1"
            case 3:
                lines[number] = damaged_text(lines[number], chance)
            case _:
                if equals:
                    lines[number] = f"{key}= {chance.choice(values)}"
    return "\n".join(lines)


# Inputs

_SYSTEM = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription version="1.0" name="pair" xmlns:own="https://tlpsim.org"
 xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
 xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"
 xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
 xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping">
<ssd:System name="root"><ssd:Connectors><ssd:Connector name="gain" kind="parameter"><ssc:Real unit="N"/></ssd:Connector>
</ssd:Connectors><ssd:ParameterBindings><ssd:ParameterBinding prefix="a." source="SET"/></ssd:ParameterBindings>
<ssd:Elements>
<ssd:Component name="a" type="application/x-fmu-sharedlibrary" source="FMU" implementation="CoSimulation">
<ssd:Connectors><ssd:Connector name="y[1]" kind="output"><ssc:Real unit="m"/></ssd:Connector></ssd:Connectors>
<ssd:Annotations><ssc:Annotation type="org.tlpsim"><own:Component step="0.1" inputsAt="end"/></ssc:Annotation>
</ssd:Annotations></ssd:Component>
<ssd:System name="inner"><ssd:Connectors><ssd:Connector name="in" kind="input"/>
<ssd:Connector name="out" kind="output"/>
</ssd:Connectors><ssd:Elements><ssd:Component name="b" source="FMU"><ssd:Annotations>
<ssc:Annotation type="org.tlpsim"><own:Component step="0.2"/></ssc:Annotation></ssd:Annotations></ssd:Component>
</ssd:Elements><ssd:Connections>
<ssd:Connection startConnector="in" endElement="b" endConnector="u[1]" suppressUnitConversion="true"/>
<ssd:Connection startElement="b" startConnector="y[2]" endConnector="out" suppressUnitConversion="true"/>
</ssd:Connections></ssd:System></ssd:Elements><ssd:Connections>
<ssd:Connection startElement="a" startConnector="y[1]" endElement="inner" endConnector="in"
 suppressUnitConversion="true">
<ssc:LinearTransformation factor="2.0" offset="0.5"/></ssd:Connection>
<ssd:Connection startElement="inner" startConnector="out" endElement="a" endConnector="u[2]"
 suppressUnitConversion="true"><ssd:Annotations><ssc:Annotation type="org.tlpsim">
<own:Connection filter="linear" extrapolation="hold"/></ssc:Annotation></ssd:Annotations></ssd:Connection>
<ssd:Connection startConnector="gain" endElement="a" endConnector="u[3]"/></ssd:Connections></ssd:System>
<ssd:DefaultExperiment startTime="0.0" stopTime="1.0"/>
<ssd:Annotations><ssc:Annotation type="org.tlpsim"><own:Master algorithm="iterative" tolerance="1e-9" most="20"/>
</ssc:Annotation></ssd:Annotations></ssd:SystemStructureDescription>"""

_SET = """<?xml version="1.0" encoding="UTF-8"?>
<ssv:ParameterSet version="1.0" name="set" xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
 xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"><ssv:Parameters>
<ssv:Parameter name="u[1]"><ssv:Real value="1.5" unit="kN"/></ssv:Parameter>
<ssv:Parameter name="fault"><ssv:Integer value="0"/></ssv:Parameter>
<ssv:Parameter name="flag_in"><ssv:Boolean value="true"/></ssv:Parameter>
<ssv:Parameter name="label"><ssv:String value="blue"/></ssv:Parameter></ssv:Parameters>
<ssv:Units><ssc:Unit name="kN"><ssc:BaseUnit kg="1" m="1" s="-2" factor="1000"/></ssc:Unit></ssv:Units>
</ssv:ParameterSet>"""


def _damaged_fmu(version: int, folder: Path, fmus: Path, chance: random.Random) -> Path:
    with zipfile.ZipFile(fmus / f"chain{version}.fmu") as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    if chance.random() < 0.9:
        xml = members["modelDescription.xml"].decode()
        members["modelDescription.xml"] = damaged_xml(xml, chance)
    path = folder / "damaged.fmu"
    path.write_bytes(damaged_zip(members, chance))
    return path


def _damaged_system(packed: bool, folder: Path, fmus: Path, chance: random.Random) -> Path:
    texts = {"SystemStructure.ssd": _SYSTEM.replace("SET", "resources/set.ssv"), "resources/set.ssv": _SET}
    texts = {name: text.replace("FMU", "resources/chain.fmu") for name, text in texts.items()}
    hit = "resources/set.ssv" if chance.random() < 0.3 else "SystemStructure.ssd"
    members = {name: text.encode() for name, text in texts.items()}
    members[hit] = damaged_xml(texts[hit], chance)
    members["resources/chain.fmu"] = (fmus / "chain2.fmu").read_bytes()
    if packed:
        path = folder / "damaged.ssp"
        path.write_bytes(damaged_zip(members, chance))
        return path
    (folder / "resources").mkdir()
    for name, data in members.items():
        (folder / name).write_bytes(data)
    return folder / "SystemStructure.ssd"


def _damaged_scenario(folder: Path, fmus: Path, chance: random.Random) -> Path:
    path = folder / "damaged.toml"
    text = (ROOT / "scenarios" / "typical_tlp.toml").read_text()
    # boundary elements take their time in any other water
    text = text.replace('hydrodynamics = "issc_tlp"', 'hydrodynamics = "morison"').replace("3600.0 ", "60.0 ")
    path.write_text(damaged_toml(text, chance), encoding="utf-8")
    return path


def damaged_input(kind: str, seed: int, folder: Path, fmus: Path) -> Path:
    """Write a damaged input into a folder.

    Parameters
    ----------
    kind
        One of `KINDS`.
    seed
        The same one always damages in the same way.
    folder
        An empty folder.
    fmus
        As of `whole_fmus`.
    """
    chance = random.Random(f"{kind} {seed}")
    if kind.startswith("fmu"):
        return _damaged_fmu(int(kind[-1]), folder, fmus, chance)
    if kind == "scenario":
        return _damaged_scenario(folder, fmus, chance)
    return _damaged_system(kind == "ssp", folder, fmus, chance)


def whole_fmus(folder: Path) -> Path:
    """Make a folder with ``chain2.fmu`` and ``chain3.fmu``, for `damaged_input`."""
    from native_fmu import build

    folder.mkdir()
    for version in (2, 3):
        build(folder, version).rename(folder / f"chain{version}.fmu")
    return folder


# Trials


def attempt(path: Path, folder: Path) -> None:
    """Open an input and run it for a few steps, with its results in a folder."""
    from tlpsim.orchestrator.observers import Observer
    from tlpsim.scenarios.assemble import assembled
    from tlpsim.scenarios.generic import opened, run_system
    from tlpsim.scenarios.run import run_scenario
    from tlpsim.scenarios.schema import Scenario

    class Enough(Exception):
        pass

    class Watch(Observer):
        def __init__(self) -> None:
            self.end = time.monotonic() + _LARGEST_RUN

        def sampled(self, index: int, times: object, values: object) -> None:
            if time.monotonic() > self.end:
                raise Enough

    try:
        if path.suffix == ".toml":
            scenario = Scenario.load(path)
            if os.environ.get("TLPSIM_HOSTILE_DEEP"):
                run_scenario(scenario, folder / "results.h5", [Watch()])
            else:
                with assembled(scenario):
                    pass
            return
        with opened([str(path)], steps=["0.1"] if path.suffix == ".fmu" else []) as description:
            stop = 1.0 if description.stop is None else description.stop
            run_system(description, folder / "results.h5", stop=stop, observers=[Watch()])
    except Enough:
        pass


def work(folder: Path, fmus: Path, cases: Iterator[str]) -> None:
    """Attempt each case ``kind seed`` and print what became of it, a line of JSON each."""
    from tlpsim.loads.errors import TlpsimError

    for case in cases:
        kind, seed = case.split()
        own = folder / f"{kind}-{seed}" / "deep" / "inside"
        own.mkdir(parents=True)
        before = _entries(own)
        os.chdir(own)
        end, message = RUN, ""
        try:
            attempt(damaged_input(kind, int(seed), own, fmus), own)
        except TlpsimError as error:
            end, message = REFUSED, str(error)
            if "\n" in message or len(message) > 2000 or not message.strip():
                end, message = FAULT, f"message of {len(message)} characters: {message[:500]!r}"
        except BaseException as error:
            last = traceback.extract_tb(error.__traceback__)[-1]
            end, message = FAULT, f"{type(error).__name__}: {error} ({last.filename}:{last.lineno})"[:1000]
        astray = sorted(name for name in _entries(own) - before if not name.startswith("deep/inside"))
        if astray:
            end, message = FAULT, f"wrote {', '.join(astray)}"
        print(json.dumps({"kind": kind, "seed": int(seed), "end": end, "message": message}), flush=True)


def _entries(own: Path) -> set[str]:
    top = own.parent.parent
    return {str(path.relative_to(top)) for path in top.rglob("*")}


def trials(
    cases: Sequence[tuple[str, int]], folder: Path, fmus: Path, timeout: float = TIMEOUT, deep: bool = False
) -> list[Outcome]:
    """Attempt damaged inputs in a process; one that crashes or hangs it is a fault, and the next ones get another.

    Parameters
    ----------
    cases
        Kinds and seeds.
    folder
        Where the inputs are put, and the only place where they may leave anything.
    fmus
        See `damaged_input`.
    timeout
        How long in s one may take.
    deep
        Step scenarios as well, and do not only assemble them.
    """
    left = list(cases)
    result: list[Outcome] = []
    environment = {**os.environ, **({"TLPSIM_HOSTILE_DEEP": "1"} if deep else {})}
    while left:
        command = [sys.executable, __file__, str(folder), str(fmus), *(f"{kind} {seed}" for kind, seed in left)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
            lines: queue.Queue[str] = queue.Queue()
            assert process.stdout is not None
            threading.Thread(target=_hand_on, args=(process.stdout, lines), daemon=True).start()
            while left:
                try:
                    line = lines.get(timeout=timeout)
                except queue.Empty:
                    process.kill()
                    result.append(Outcome(kind=left[0][0], seed=left[0][1], end=FAULT, message=f"hung for {timeout} s"))
                    del left[0]
                    break
                if not line:
                    status = process.wait()
                    message = f"ended its process with status {status}"
                    result.append(Outcome(kind=left[0][0], seed=left[0][1], end=FAULT, message=message))
                    del left[0]
                    break
                if re.match(r'\{"kind"', line):
                    result.append(Outcome(**json.loads(line)))
                    del left[0]
            process.kill()
    return result


def _hand_on(stream: IO[str], lines: "queue.Queue[str]") -> None:
    """Put the lines of a stream into a queue as they come, and at its end an empty one."""
    for line in stream:
        lines.put(line)
    lines.put("")


if __name__ == "__main__":
    work(Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve(), iter(sys.argv[3:]))
