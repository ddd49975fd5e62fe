"""The standard SSP: systems that are written and read again, with real FMUs."""

import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import fmpy
import pytest
from fmpy.ssp.ssd import read_ssd
from lxml import etree

from tlpsim.loads.errors import WiringError
from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.fmi.opening import open_fmu
from tlpsim.orchestrator.instance import PythonInstance
from tlpsim.orchestrator.observers import MemoryRecorder
from tlpsim.orchestrator.ssp.annotations import SspError, SystemDescription
from tlpsim.orchestrator.ssp.read import read_ssp
from tlpsim.orchestrator.ssp.write import write_ssp
from tlpsim.orchestrator.system import Component, Connection, Iteration, System

SECOND = 1_000_000_000
SCHEMAS = Path(fmpy.__file__).parent / "ssp" / "schema"


def chain(fmu: Path) -> System:
    wires = [
        Connection(
            source="a",
            source_variable=f"y[{k}]",
            target="b of c",
            target_variable=f"u[{k}]",
            filter="linear",
            extrapolation="hold",
            factor=0.1 * k,
            offset=0.3,
            suppress_unit_conversion=True,
        )
        for k in range(1, 4)
    ]
    label = 'text "with" <marks> & lines\n\tüß'
    return System(
        components=(
            Component(
                instance=open_fmu("a", fmu),
                step=SECOND // 10,
                parameters={"u[1]": 1.0 / 3.0, "u[2]": 2, "label": label, "fault_time": 1e-7, "fault": 0},
                inputs_at="middle",
                outputs=("y[2]", "y[1]"),
            ),
            Component(instance=open_fmu("b of c", fmu), step=SECOND // 4, outputs=()),
        ),
        connections=tuple(wires),
        algorithm="sequential",
        iteration=Iteration(most=9),
    )


def values_of(made: System) -> dict[str, bytes]:
    recorder = MemoryRecorder()
    names = [component.name for component in made.components]
    run(made, 2 * SECOND, observers=[recorder])
    return {name: recorder.values(name).tobytes() for name in names}


@pytest.mark.parametrize("ending", ["ssp", "ssd"])
@pytest.mark.parametrize("version", [2, 3])
def test_a_system_written_and_read_again_is_the_same(
    tmp_path: Path, chain_fmu: Callable[[int], Path], version: int, ending: str
) -> None:
    made = chain(chain_fmu(version))
    path = write_ssp(SystemDescription(name="chain", system=made, start=0.0, stop=2.0), tmp_path / f"chain.{ending}")
    found = read_ssp(path, open_fmu)
    assert (found.name, found.start, found.stop, found.notes) == ("chain", 0.0, 2.0, ())
    assert (found.system.algorithm, found.system.iteration) == (made.algorithm, made.iteration)
    assert found.system.connections == made.connections
    for one, other in zip(found.system.components, made.components, strict=True):
        assert replace(one, instance=other.instance) == other
        assert one.instance.describe()["sha256"] == other.instance.describe()["sha256"]
    assert values_of(found.system) == values_of(made)


def test_a_package_keeps_to_the_standard(tmp_path: Path, chain_fmu: Callable[[int], Path]) -> None:
    made = SystemDescription(name="chain", system=chain(chain_fmu(2)), stop=2.0)
    path = write_ssp(made, tmp_path / "chain.ssp")
    schemas = {".ssd": "SystemStructureDescription.xsd", ".ssv": "SystemStructureParameterValues.xsd"}
    with zipfile.ZipFile(path) as package:
        names = package.namelist()
        assert names == ["SystemStructure.ssd", "resources/Chain_fmi2_6_12.fmu", "resources/a.ssv"]
        for name in names:
            if name[-4:] in schemas:
                schema = etree.XMLSchema(etree.parse(SCHEMAS / schemas[name[-4:]]))
                schema.assertValid(etree.fromstring(package.read(name)))
    # and another reader finds in it what was written
    other = read_ssd(str(path))
    assert [each.name for each in other.system.elements] == ["a", "b of c"]
    assert [(each.startConnector, each.endConnector) for each in other.system.connections] == [
        (f"y[{k}]", f"u[{k}]") for k in range(1, 4)
    ]
    again = write_ssp(made, tmp_path / "again.ssp")
    assert again.read_bytes() == path.read_bytes()


def test_only_fmus_can_be_written(tmp_path: Path, chain_fmu: Callable[[int], Path]) -> None:
    made = System(components=(Component(instance=PythonInstance("a", lambda values, time, size: None), step=1),))
    with pytest.raises(SspError, match="'a' is not an FMU"):
        write_ssp(SystemDescription(name="x", system=made), tmp_path / "x.ssp")
    assert not list(tmp_path.iterdir())
    with pytest.raises(SspError, match=r"not as '\.zip'"):
        write_ssp(SystemDescription(name="x", system=made), tmp_path / "x.zip")
    made = chain(chain_fmu(2))
    with pytest.raises(SspError, match="cannot be written: No such file or directory"):
        write_ssp(SystemDescription(name="x", system=made), tmp_path / "none" / "x.ssp")
    twice = replace(made, connections=made.connections * 2)
    with pytest.raises(WiringError, match="already fed"):
        write_ssp(SystemDescription(name="x", system=twice), tmp_path / "x.ssp")
