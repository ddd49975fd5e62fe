"""Model descriptions of FMI 2.0 and 3.0, good and malformed, and files that try to do harm."""

import math
import stat
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

from tlpsim.loads.errors import FmuError
from tlpsim.orchestrator import archive
from tlpsim.orchestrator.fmi import description
from tlpsim.orchestrator.fmi.description import (
    CO_SIMULATION,
    MODEL_EXCHANGE,
    FmuDescription,
    extracted,
    read_description,
)
from tlpsim.orchestrator.fmi.model_variables import element_names
from tlpsim.orchestrator.instance import Unit

Write = Callable[..., Path]

UNITS = """<UnitDefinitions>
<Unit name="kN"><BaseUnit kg="1" m="1" s="-2" factor="1000"/><DisplayUnit name="N" factor="1000"/></Unit>
<Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit><Unit name="bare"/></UnitDefinitions>"""

FMI2 = f"""<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g" numberOfEventIndicators="2">
<ModelExchange modelIdentifier="me" completedIntegratorStepNotNeeded="true"/>
<CoSimulation modelIdentifier="cs" canGetAndSetFMUstate="1" needsExecutionTool="true" maxOutputDerivativeOrder="2"/>
{UNITS}
<TypeDefinitions><SimpleType name="Force"><Real quantity="Force" unit="kN"/></SimpleType></TypeDefinitions>
<DefaultExperiment startTime="0" stopTime="2.5" stepSize="0.01"/>
<LogCategories><Category name="logStatusError"/></LogCategories>
<ModelVariables>
<ScalarVariable name="f" valueReference="3" causality="input">
<Real declaredType="Force" start=" 1e3 "/></ScalarVariable>
<ScalarVariable name="n" valueReference="3" causality="input" variability="discrete">
<Integer start="-4"/></ScalarVariable>
<ScalarVariable name="x" valueReference="1" causality="output"><Real unit="m"/></ScalarVariable>
<ScalarVariable name="der(x)" valueReference="2"><Real derivative="3"/></ScalarVariable>
<ScalarVariable name="on" valueReference="1" causality="parameter"><Boolean start="true"/></ScalarVariable>
<ScalarVariable name="mode" valueReference="9" causality="parameter">
<Enumeration declaredType="M" start="2"/></ScalarVariable>
<ScalarVariable name="text" valueReference="4" causality="parameter"><String start="a b"/></ScalarVariable>
<ScalarVariable name="free" valueReference="5" causality="output"><Real/></ScalarVariable>
</ModelVariables>
<ModelStructure>
<Outputs><Unknown index="3" dependencies="1 4"/><Unknown index="8"/></Outputs>
<Derivatives><Unknown index="4"/></Derivatives>
</ModelStructure></fmiModelDescription>"""

FMI3 = f"""<fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="token">
<ModelExchange modelIdentifier="me" needsCompletedIntegratorStep="false"/>
<CoSimulation modelIdentifier="cs" canGetAndSetFMUState="true" providesDirectionalDerivatives="true" hasEventMode="1"
 canReturnEarlyAfterIntermediateUpdate="true" maxOutputDerivativeOrder="1"/>
{UNITS}
<TypeDefinitions><Float64Type name="Force" unit="kN"/><EnumerationType name="M"/></TypeDefinitions>
<ModelVariables>
<UInt64 name="rows" valueReference="1" causality="structuralParameter" start="2"/>
<Float64 name="A" valueReference="2" causality="parameter" start="1 2 3 4 5 6">
<Dimension valueReference="1"/><Dimension start="3"/></Float64>
<Float64 name="u" valueReference="3" causality="input" declaredType="Force" start="7"><Dimension start="3"/></Float64>
<Float32 name="y" valueReference="4" causality="output"><Dimension valueReference="1"/><Alias name="z"/></Float32>
<Float64 name="x" valueReference="5"><Dimension valueReference="1"/></Float64>
<Float64 name="v" valueReference="6" derivative="5"><Dimension valueReference="1"/></Float64>
<UInt8 name="byte" valueReference="7" causality="input" start="255"/>
<Enumeration name="mode" valueReference="8" causality="parameter" declaredType="M" start="1"/>
<Boolean name="flags" valueReference="9" causality="parameter" start="true 0"><Dimension start="2"/></Boolean>
<String name="words" valueReference="10" causality="parameter"><Dimension start="2"/>
<Start value="a b"/><Start value=""/></String>
<Binary name="blob" valueReference="11" causality="input"><Start value="00"/></Binary>
<Clock name="tick" valueReference="12" intervalVariability="triggered"/>
<Float64 name="sampled" valueReference="13" causality="output" clocks="12"/>
<Int64 name="none" valueReference="14" causality="output"><Dimension start="0"/></Int64>
</ModelVariables>
<ModelStructure><Output valueReference="4" dependencies="3 2"/><Output valueReference="13"/>
<ContinuousStateDerivative valueReference="6"/><EventIndicator valueReference="4"/></ModelStructure>
</fmiModelDescription>"""


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Function that packs a model description, with changes, and other members as an FMU."""

    def pack(xml: str | bytes, *changes: tuple[str, str], members: dict[str, bytes] | None = None) -> Path:
        for old, new in changes:
            assert isinstance(xml, str)
            assert old in xml
            xml = xml.replace(old, new)
        path = tmp_path / "model.fmu"
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
            file.writestr("modelDescription.xml", xml)
            for name, data in (members or {}).items():
                file.writestr(name, data)
        return path

    return pack


def test_fmi2(write: Write) -> None:
    said = read_description(write(FMI2, members={"binaries/win64/cs.dll": b""}))
    assert (said.fmi_version, said.fmi_major, said.guid, said.model_name) == ("2.0", 2, "g", "m")
    assert {kind: entry.model_identifier for kind, entry in said.kinds.items()} == {
        MODEL_EXCHANGE: "me",
        CO_SIMULATION: "cs",
    }
    assert said.capabilities["canGetAndSetFMUstate"]
    assert said.capabilities["needsExecutionTool"]
    assert not said.capabilities["hasEventMode"]
    assert said.kinds[MODEL_EXCHANGE].capabilities["completedIntegratorStepNotNeeded"]
    assert said.kinds[CO_SIMULATION].max_output_derivative_order == 2
    assert said.binaries == {"binaries/win64/cs.dll"}
    assert said.default_experiment == {"startTime": 0.0, "stopTime": 2.5, "stepSize": 0.01}
    assert said.log_categories == ("logStatusError",)
    assert (said.state_derivatives, said.event_indicators) == (("der(x)",), 2)
    assert said.arrays == {}
    f, x = said.variables["f"], said.variables["x"]
    assert (f.type, f.unit, f.start, f.causality, f.variability) == ("Real", "kN", 1000.0, "input", "continuous")
    assert (x.unit, x.start, x.depends_on) == ("m", None, ("f",))
    assert said.variables["free"].depends_on is None
    assert said.variables["der(x)"].derivative_of == "x"
    starts = [said.variables[name].start for name in ("n", "on", "mode", "text")]
    assert starts == [-4, True, 2, "a b"]
    assert [said.variables[name].type for name in ("n", "on", "mode", "text")] == [
        "Integer",
        "Boolean",
        "Integer",
        "String",
    ]
    assert said.variables["mode"].variability == "fixed"
    assert (said.places["mode"].type, said.places["mode"].reference) == ("Integer", 9)


def test_fmi3(write: Write) -> None:
    said = read_description(write(FMI3))
    assert (said.fmi_version, said.fmi_major, said.guid) == ("3.0", 3, "token")
    for name in ("canGetAndSetFMUstate", "providesDirectionalDerivative", "hasEventMode"):
        assert said.capabilities[name]
    assert said.capabilities["canReturnEarlyAfterIntermediateUpdate"]
    assert not said.capabilities["canSerializeFMUstate"]
    assert said.kinds[MODEL_EXCHANGE].capabilities["completedIntegratorStepNotNeeded"]
    assert said.kinds[CO_SIMULATION].max_output_derivative_order == 1
    shapes = {
        "A": (2, 3),
        "u": (3,),
        "y": (2,),
        "z": (2,),
        "x": (2,),
        "v": (2,),
        "flags": (2,),
        "words": (2,),
        "none": (0,),
    }
    assert said.arrays == shapes
    assert [said.variables[f"A[{row},{column}]"].start for row in (1, 2) for column in (1, 2, 3)] == [1, 2, 3, 4, 5, 6]
    assert (said.places["A[2,1]"].variable, said.places["A[2,1]"].position, said.places["A[2,1]"].size) == ("A", 3, 6)
    assert [said.variables[name].start for name in ("u[1]", "u[3]", "byte", "mode")] == [7.0, 7.0, 255, 1]
    assert [said.variables[name].start for name in ("flags[1]", "flags[2]", "words[1]")] == [True, False, "a b"]
    assert said.variables["u[2]"].unit == "kN"
    assert (said.variables["y[1]"].type, said.places["y[1]"].type) == ("Real", "Float32")
    assert said.variables["z[2]"].depends_on == ("u[1]", "u[2]", "u[3]")
    assert said.places["z[2]"].reference == said.places["y[2]"].reference
    assert said.variables["v[2]"].derivative_of == "x[2]"
    assert (said.places["mode"].type, said.variables["byte"].variability) == ("Int64", "discrete")
    assert said.variables["rows"].causality == "structuralParameter"
    for name in ("blob", "tick", "sampled", "none", "A", "none[1]"):
        assert name not in said.variables
    assert (said.state_derivatives, said.event_indicators) == (("v[1]", "v[2]"), 2)


@pytest.mark.parametrize("xml", [FMI2, FMI3])
def test_units(write: Write, xml: str) -> None:
    said = read_description(write(xml))
    assert said.units == {
        "kN": Unit(exponents=(1, 1, -2, 0, 0, 0, 0, 0), factor=1000.0),
        "degC": Unit(exponents=(0, 0, 0, 0, 1, 0, 0, 0), offset=273.15),
    }


def test_special_numbers(write: Write) -> None:
    said = read_description(write(FMI2, ('start=" 1e3 "', 'start="-INF"')))
    assert said.variables["f"].start == -math.inf


def test_names_of_elements() -> None:
    assert element_names("x", ()) == ("x",)
    assert element_names("x", (3,)) == ("x[1]", "x[2]", "x[3]")
    assert element_names("x", (2, 2)) == ("x[1,1]", "x[1,2]", "x[2,1]", "x[2,2]")


FAULTS: dict[str, tuple[str, str, str, str]] = {
    "no name": (FMI2, 'name="f" ', "", "variable number 1 has no name"),
    "reference": (FMI2, 'valueReference="9"', 'valueReference="-9"', "'mode' has the malformed valueReference '-9'"),
    "no reference": (FMI2, 'valueReference="9"', "", "'mode' has no valueReference"),
    "start": (FMI2, 'start="-4"', 'start="four"', "'n' has the malformed start 'four'"),
    "boolean": (FMI2, 'start="true"', 'start="yes"', "'on' has the malformed start 'yes'"),
    "derivative": (FMI2, 'derivative="3"', 'derivative="0"', r"'der\(x\)' has the malformed derivative '0'"),
    "far derivative": (FMI2, 'derivative="3"', 'derivative="99"', "malformed derivative '99'"),
    "dependency": (FMI2, 'dependencies="1 4"', 'dependencies="1 x"', "'x' has the malformed dependencies '1 x'"),
    "output": (FMI2, 'index="8"', 'index="80"', "ModelStructure has the malformed index '80'"),
    "twice": (FMI2, 'name="n"', 'name="f"', "variable 'f' is declared twice"),
    "exponent": (FMI2, 's="-2"', 's="-2.5"', r"unit 'kN' has the malformed s '-2\.5'"),
    "factor": (FMI3, 'factor="1000"/><D', 'factor="k"/><D', "unit 'kN' has the malformed factor 'k'"),
    "no factor": (FMI3, 'factor="1000"/><D', 'factor="0"/><D', "unit 'kN' has the factor 0"),
    "order": (FMI2, 'Order="2"', 'Order="two"', "CoSimulation has the malformed maxOutputDerivativeOrder 'two'"),
    "step": (FMI2, 'stepSize="0.01"', 'stepSize="?"', r"DefaultExperiment has the malformed stepSize '\?'"),
    "version": (FMI3, 'fmiVersion="3.0"', 'fmiVersion="3.0-beta.1"', r"version 3\.0-beta\.1; only 2\.0 and 3\.0 are"),
    "old version": (FMI2, 'fmiVersion="2.0"', 'fmiVersion="1.0"', r"version 1\.0; only 2\.0 and 3\.0 are supported"),
    "dimension": (FMI3, 'start="7"><Dimension start="3"/>', '><Dimension start="-3"/>', "'u': Dimension has .* '-3'"),
    "structural": (FMI3, '<Dimension valueReference="1"/><Dim', '<Dimension valueReference="99"/><Dim', "'A'.* '99'"),
    "no size": (
        FMI3,
        '<Dimension valueReference="1"/><Dim',
        "<Dimension/><Dim",
        "'A': Dimension has no valueReference",
    ),
    "no start": (FMI3, 'Parameter" start="2"', 'Parameter"', "'rows' has no start"),
    "starts": (FMI3, '"1 2 3 4 5 6"', '"1 2 3"', "'A' has 3 start values for 6 elements"),
    "bad start": (FMI3, '"1 2 3 4 5 6"', '"1 2 3 4 5 6,0"', "'A' has the malformed start"),
    "too many": (
        FMI3,
        '<Dimension start="0"/>',
        '<Dimension start="4000000"/>',
        r"'none'.* 4000\d+ elements; .* 1000000",
    ),
    "no kind": (FMI2.replace("ModelExchange", "Other"), "<CoSimulation", "<Another", "neither for co-simulation nor"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_malformed_description(write: Write, fault: str) -> None:
    xml, old, new, message = FAULTS[fault]
    path = write(xml, (old, new))
    with pytest.raises(FmuError, match=message) as caught:
        read_description(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


BOMB = '<!DOCTYPE b [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'
FILE = '<!DOCTYPE b [<!ENTITY f SYSTEM "file:///etc/hostname">]>'


@pytest.mark.parametrize("document_type", [BOMB, FILE, '<!DOCTYPE b SYSTEM "http://localhost/b.dtd">'])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_document_types_are_refused(write: Write, document_type: str, encoding: str) -> None:
    text = f'<?xml version="1.0" encoding="{encoding}"?>{document_type}{FMI2}'
    with pytest.raises(FmuError, match=r"modelDescription\.xml: the XML has a DOCTYPE"):
        read_description(write(text.encode(encoding)))


def test_a_model_description_that_is_a_bomb(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(description, "_LARGEST_XML", 1000)
    with pytest.raises(FmuError, match=r"modelDescription\.xml has \d+ bytes and may have 1000"):
        read_description(write(FMI2))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("../outside.txt", "leads out of the folder"),
        ("resources/../../outside.txt", "leads out of the folder"),
        ("/tmp/outside.txt", "has no relative path"),
        ("C:/outside.txt", "has no relative path"),
        ("resources\\..\\..\\outside.txt", "has no relative path"),
    ],
)
def test_members_that_leave_the_folder(write: Write, tmp_path: Path, name: str, message: str) -> None:
    said = read_description(write(FMI2, members={name: b"x"}))
    with pytest.raises(FmuError, match=message) as caught:
        extracted(said)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.rglob("outside.txt"))


def test_links_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "link.fmu"
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("modelDescription.xml", FMI2)
        link = zipfile.ZipInfo("resources/passwords")
        link.external_attr = (stat.S_IFLNK | 0o777) << 16
        file.writestr(link, "/etc/passwd")
    with pytest.raises(FmuError, match="'resources/passwords' is a link or a device"):
        extracted(read_description(path))


@pytest.mark.parametrize(
    ("limit", "value", "message"),
    [
        ("LARGEST_SIZE", 1_000_000, "extracts to 5001.* bytes and may have 1000000"),
        ("HARMLESS_SIZE", 1_000_000, "more than 500 times its own"),
        ("LARGEST_COUNT", 1, "has 2 members and may have 1"),
    ],
)
def test_zip_bombs(write: Write, monkeypatch: pytest.MonkeyPatch, limit: str, value: int, message: str) -> None:
    said: FmuDescription = read_description(write(FMI2, members={"resources/zeros": bytes(50_010_000)}))
    monkeypatch.setattr(archive, limit, value)
    with pytest.raises(FmuError, match=message):
        extracted(said)
