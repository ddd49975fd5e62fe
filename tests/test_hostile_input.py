"""Damaged files end in a run or in an error of one line: never in a traceback, a crash, a hang or a file elsewhere."""

from pathlib import Path

import hostile_input
import native_fmu
import pytest

from tlpsim.loads.errors import FmuError, TlpsimError
from tlpsim.orchestrator.fmi.description import read_description
from tlpsim.orchestrator.fmi.opening import open_fmu
from tlpsim.orchestrator.ssp.annotations import SspError
from tlpsim.orchestrator.ssp.read import read_ssp

COUNTS = {"fmu2": 25, "fmu3": 25, "ssd": 40, "ssp": 20, "scenario": 25}


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if native_fmu.COMPILER is None:
        pytest.skip(native_fmu.NO_COMPILER)
    return hostile_input.whole_fmus(tmp_path_factory.mktemp("whole") / "fmus")


@pytest.mark.parametrize("kind", hostile_input.KINDS)
def test_damaged_inputs(kind: str, fmus: Path, tmp_path: Path) -> None:
    cases = [(kind, seed) for seed in range(COUNTS[kind])]
    found = hostile_input.trials(cases, tmp_path, fmus)
    assert [each for each in found if each.end == hostile_input.FAULT] == []
    assert len(found) == len(cases)
    assert {each.end for each in found} == {hostile_input.RUN, hostile_input.REFUSED}


def test_an_error_is_of_one_line_whatever_it_quotes() -> None:
    assert str(TlpsimError("'a\n\tb' of\r\nc\u2028d")) == "'a b' of c d"
    text = str(TlpsimError(f"x.fmu: {'a' * 9000}; export it again"))
    assert len(text) == 2000
    assert text.startswith("x.fmu: aaa")
    assert text.endswith("a; export it again")


@pytest.mark.parametrize("name", ["\0.fmu", "~nobody_of_this_name/x.fmu", "a" * 5000 + ".fmu"])
def test_paths_that_are_none(name: str) -> None:
    with pytest.raises(FmuError, match="the FMU cannot be opened: "):
        read_description(name)


@pytest.mark.parametrize(
    ("source", "message"), [("a" * 300, "is no path: "), ("%00", "is no path: "), ("//[", "no URI")]
)
def test_sources_that_are_no_paths(source: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "system.ssd"
    path.write_text(
        '<s:SystemStructureDescription version="1.0" xmlns:s="http://ssp-standard.org/SSP1/SystemStructureDescription">'
        f'<s:System><s:Elements><s:Component name="a" source="{source}"/></s:Elements></s:System>'
        "</s:SystemStructureDescription>"
    )
    with pytest.raises(SspError, match=message):
        read_ssp(path, open_fmu)
