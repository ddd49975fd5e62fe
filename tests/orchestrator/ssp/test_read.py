"""The standard SSP: what is read, what is refused, and systems that are written and read again."""

import zipfile
from collections.abc import Callable
from pathlib import Path

import fmpy
import numpy as np
import pytest

from tlpsim.loads.errors import TlpsimError
from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.instance import Instance, PythonInstance
from tlpsim.orchestrator.observers import MemoryRecorder
from tlpsim.orchestrator.ssp.annotations import OWN, SspError, SystemDescription
from tlpsim.orchestrator.ssp.read import read_ssp
from tlpsim.orchestrator.system import Connection, Iteration, check, conversion

SECOND = 1_000_000_000
SCHEMAS = Path(fmpy.__file__).parent / "ssp" / "schema"

HEAD = (
    '<ssd:SystemStructureDescription version="1.0" name="pair" '
    'xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" '
    'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" '
    'xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" '
    'xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping" '
    f'xmlns:own="{OWN}">'
)
SSV = (
    '<ssv:ParameterSet version="1.0" name="set" '
    'xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" '
    'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon">'
)


def component(name: str, inside: str = "", step: str = "0.1") -> str:
    own = f'<ssd:Annotations><ssc:Annotation type="org.tlpsim"><own:Component step="{step}"/></ssc:Annotation>'
    return f'<ssd:Component name="{name}" source="{name}.fmu">{inside}{own}</ssd:Annotations></ssd:Component>'


def connection(start: str, end: str, inside: str = "", more: str = "") -> str:
    ends = []
    for side, text in (("start", start), ("end", end)):
        element, dot, connector = text.rpartition(".")
        ends.append(f'{side}Element="{element}" ' if dot else "")
        ends.append(f'{side}Connector="{connector}"')
    return f"<ssd:Connection {' '.join(ends)} {more}>{inside}</ssd:Connection>"


def system(elements: str, connections: str = "", before: str = "", name: str = "root") -> str:
    joined = f"<ssd:Connections>{connections}</ssd:Connections>" if connections else ""
    return f'<ssd:System name="{name}">{before}<ssd:Elements>{elements}</ssd:Elements>{joined}</ssd:System>'


def inline(parameters: str, mapping: str = "", more: str = "", after: str = "") -> str:
    mapped = f'<ssd:ParameterMapping><ssm:ParameterMapping version="1.0">{mapping}</ssm:ParameterMapping>'
    return (
        f"<ssd:ParameterBindings><ssd:ParameterBinding {more}><ssd:ParameterValues>{SSV}<ssv:Parameters>{parameters}"
        f"</ssv:Parameters>{after}</ssv:ParameterSet></ssd:ParameterValues>"
        f"{mapped + '</ssd:ParameterMapping>' if mapping else ''}</ssd:ParameterBinding></ssd:ParameterBindings>"
    )


def real(name: str, value: object, unit: str = "") -> str:
    shown = f'unit="{unit}"' if unit else ""
    return f'<ssv:Parameter name="{name}"><ssv:Real value="{value}" {shown}/></ssv:Parameter>'


def linear(factor: float, offset: float = 0.0) -> str:
    return f'<ssc:LinearTransformation factor="{factor}" offset="{offset}"/>'


def connectors(*named: str) -> str:
    kinds = (each.split(":") for each in named)
    return (
        "<ssd:Connectors>"
        + "".join(f'<ssd:Connector name="{name}" kind="{kind}"><ssc:Real/></ssd:Connector>' for name, kind in kinds)
        + "</ssd:Connectors>"
    )


def gain(name: str, path: Path) -> Instance:
    """y = gain u, with the input in kN and the output in N."""

    def initialize(values: dict, time: float) -> None:
        values["y"] = values["gain"] * values["u"]

    return PythonInstance(
        name,
        lambda values, time, size: initialize(values, time + size),
        inputs={"u": 0.0},
        outputs={"y": 0.0},
        parameters={"gain": 1.0, "count": 1, "loud": False, "label": "none"},
        initialize=initialize,
        units={"u": "kN", "y": "N", "gain": "m"},
    )


@pytest.fixture
def read(tmp_path: Path) -> Callable[..., SystemDescription]:
    """Function that reads a description of components whose FMUs are stand-ins."""

    def read_text(text: str, after: str = "", version: str = "1.0", **options: object) -> SystemDescription:
        for name in "abc":
            (tmp_path / f"{name}.fmu").touch()
        head = HEAD.replace('version="1.0"', f'version="{version}"')
        (tmp_path / "system.ssd").write_text(f"{head}{text}{after}</ssd:SystemStructureDescription>")
        return read_ssp(tmp_path / "system.ssd", gain, **options)  # type: ignore[arg-type]

    return read_text


def parameters_of(description: SystemDescription, name: str) -> dict[str, object]:
    return next(dict(each.parameters) for each in description.system.components if each.name == name)


def test_components_connections_and_experiment(read: Callable[..., SystemDescription]) -> None:
    found = read(
        system(component("a") + component("b", step="0.25"), connection("a.y", "b.u", linear(2.0, 5.0))),
        '<ssd:DefaultExperiment startTime="1" stopTime="4.5"/>',
    )
    assert (found.name, found.start, found.stop) == ("pair", 1.0, 4.5)
    assert [(each.name, each.step) for each in found.system.components] == [("a", SECOND // 10), ("b", SECOND // 4)]
    wire = Connection(source="a", source_variable="y", target="b", target_variable="u", factor=2.0, offset=5.0)
    assert found.system.connections == (wire,)
    assert conversion(found.system, wire) == (2e-3, 5.0)
    assert check(found.system) == ["input a.u is not connected and keeps its start value"]


def test_a_connection_may_be_written_from_its_input(read: Callable[..., SystemDescription]) -> None:
    found = read(system(component("a") + component("b"), connection("b.u", "a.y")))
    assert str(found.system.connections[0]) == "a.y -> b.u"


def test_nested_systems_are_resolved(read: Callable[..., SystemDescription]) -> None:
    inner = system(
        component("b"),
        connection("in", "b.u", linear(2.0, 1.0)) + connection("b.y", "out", linear(1.0, 3.0)),
        connectors("in:input", "out:output"),
        "inner",
    )
    wires = connection("a.y", "inner.in", linear(10.0, 4.0), 'suppressUnitConversion="true"')
    found = read(system(component("a") + inner + component("c"), wires + connection("inner.out", "c.u")))
    assert [each.name for each in found.system.components] == ["a", "inner.b", "c"]
    first, second = found.system.connections
    assert (str(first), first.factor, first.offset) == ("a.y -> inner.b.u", 20.0, 9.0)
    assert first.suppress_unit_conversion
    assert (str(second), second.factor, second.offset) == ("inner.b.y -> c.u", 1.0, 3.0)
    assert not second.suppress_unit_conversion


def test_parameters_with_units_mapping_and_prefix(read: Callable[..., SystemDescription], tmp_path: Path) -> None:
    mm = '<ssc:Units><ssc:Unit name="ell"><ssc:BaseUnit m="1" factor="0.5"/></ssc:Unit></ssc:Units>'
    (tmp_path / "set.ssv").write_text(
        f'{SSV}<ssv:Parameters><ssv:Parameter name="n"><ssv:Integer value="7"/></ssv:Parameter><ssv:Parameter '
        'name="loud"><ssv:Boolean value="true"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>'
    )
    (tmp_path / "map.ssm").write_text(
        '<ParameterMapping version="1.0" xmlns="http://ssp-standard.org/SSP1/SystemStructureParameterMapping">'
        '<MappingEntry source="x.n" target="count"/></ParameterMapping>'
    )
    files = (
        '<ssd:ParameterBindings><ssd:ParameterBinding source="set.ssv" prefix="x."><ssd:ParameterMapping '
        'source="map.ssm"/></ssd:ParameterBinding></ssd:ParameterBindings>'
    )
    entry = f'<ssm:MappingEntry source="length" target="gain">{linear(3.0, 1.0)}</ssm:MappingEntry>'
    found = read(
        system(
            component("a", inline(real("gain", 8.0, "ell"), after=mm.replace("ssc:Units", "ssv:Units")))
            + component("b", inline(real("length", 200.0, "cm"), entry))
            + component("c", files)
        )
    )
    assert parameters_of(found, "a") == {"gain": 4.0}
    assert parameters_of(found, "b") == {"gain": 7.0}
    assert parameters_of(found, "c") == {"count": 7}  # what is not mapped is not applied


def test_outer_bindings_go_over_inner_ones_and_later_over_earlier(read: Callable[..., SystemDescription]) -> None:
    inner = system(component("b", inline(real("gain", 1.0))), before=inline(real("b.gain", 2.0)), name="inner")
    assert parameters_of(read(system(inner)), "inner.b") == {"gain": 2.0}
    outer = inline(real("inner.b.gain", 3.0) + real("nothing", 1.0))
    found = read(system(inner, before=outer))
    assert parameters_of(found, "inner.b") == {"gain": 3.0}
    assert found.notes[0].endswith("'nothing' is the name of no variable; the value is not used")
    twice = inline(real("gain", 1.0)).replace(
        "</ssd:ParameterBindings>", inline(real("gain", 5.0)).replace("<ssd:ParameterBindings>", "")
    )
    assert parameters_of(read(system(component("a", twice))), "a") == {"gain": 5.0}


def test_connectors_of_systems_pass_parameters_and_start_values_on(read: Callable[..., SystemDescription]) -> None:
    inner = system(
        component("b"),
        connection("k", "b.gain", linear(2.0)) + connection("in", "b.u"),
        connectors("k:parameter", "in:input"),
        "inner",
    )
    found = read(
        system(
            inner,
            connection("size", "inner.k") + connection("load", "inner.in"),
            connectors("size:parameter", "load:input") + inline(real("size", 300.0, "cm") + real("load", 6e3, "N")),
        )
    )
    assert parameters_of(found, "inner.b") == {"gain": 6.0, "u": 6.0}
    assert found.system.connections == ()


def test_types_of_fmi_3_enumerations_and_arrays(read: Callable[..., SystemDescription]) -> None:
    values = (
        '<ssv:Parameter name="gain"><ssv:Float64 value="2.5"/></ssv:Parameter>'
        '<ssv:Parameter name="count"><ssv:Enumeration value="two" name="number"/></ssv:Parameter>'
        '<ssv:Parameter name="label"><ssv:String value=" a b "/></ssv:Parameter>'
        '<ssv:Parameter name="loud"><ssv:Boolean value="1"/></ssv:Parameter>'
    )
    table = (
        '<ssv:Enumerations><ssc:Enumeration name="number"><ssc:Item name="two" value="2"/></ssc:Enumeration>'
        "</ssv:Enumerations>"
    )
    found = read(system(component("a", inline(values, after=table))), version="2.0")
    assert parameters_of(found, "a") == {"gain": 2.5, "count": 2, "label": " a b ", "loud": True}
    arrays = inline('<ssv:Parameter name="u"><ssv:Float64 value="1 2 3"/></ssv:Parameter>')
    assert parameters_of(read(system(component("a", arrays))), "a") == {"u": [1.0, 2.0, 3.0]}


def test_our_annotations(read: Callable[..., SystemDescription]) -> None:
    own = '<ssd:Annotations><ssc:Annotation type="org.tlpsim">{}</ssc:Annotation></ssd:Annotations>'
    chosen = (
        '<ssd:Component name="a" source="a.fmu">'
        + own.format('<own:Component step="1" inputsAt="start" outputs="chosen"><own:Output name="y"/></own:Component>')
        + "</ssd:Component>"
    )
    wire = connection("a.y", "b.u", own.format('<own:Connection filter="linear" extrapolation="hold"/>'))
    found = read(
        system(chosen + component("b"), wire),
        own.format('<own:Master algorithm="iterative" most="7" tolerance="1e-3"/>'),
    )
    first = found.system.components[0]
    assert (first.inputs_at, first.outputs, first.step) == ("start", ("y",), SECOND)
    assert (found.system.connections[0].filter, found.system.connections[0].extrapolation) == ("linear", "hold")
    assert found.system.algorithm == "iterative"
    assert found.system.iteration == Iteration(tolerance=1e-3, most=7)


def test_steps_that_the_file_does_not_give(
    read: Callable[..., SystemDescription], tmp_path: Path, chain_fmu: Callable[[int], Path]
) -> None:
    plain = system('<ssd:Component name="a" source="a.fmu"/>')
    assert read(plain, step=0.5).system.components[0].step == SECOND // 2
    with zipfile.ZipFile(chain_fmu(2)) as old, zipfile.ZipFile(tmp_path / "d.fmu", "w") as new:
        for name in old.namelist():
            data = old.read(name)
            if name == "modelDescription.xml":
                data = data.replace(b"<ModelVariables>", b'<DefaultExperiment stepSize="0.2"/><ModelVariables>')
            new.writestr(name, data)
    assert read(plain.replace("a.fmu", "d.fmu")).system.components[0].step == SECOND // 5
    (tmp_path / "e.fmu").write_bytes(chain_fmu(2).read_bytes())
    with pytest.raises(SspError, match=r"'a': neither .* gives a step; give one in the annotation .* or for all"):
        read(plain.replace("a.fmu", "e.fmu"))


PAIR = component("a") + component("b")
FAULTS = {
    "no system": ("", "has no <System>"),
    "twice": (system(component("a") * 2), "element 'a' exists twice"),
    "no name": (system(component("")), "<Component> has no attribute 'name'"),
    "missing file": (system(component("z")), "component 'z': there is no file 'z.fmu'"),
    "remote": (system(component("a").replace("a.fmu", "https://x/a.fmu")), "is not a file relative to the description"),
    "type": (
        system(component("a").replace("source=", 'type="application/x-ssp-package" source=')),
        "only FMUs, application/x-fmu-sharedlibrary, are supported",
    ),
    "implementation": (
        system(component("a").replace("source=", 'implementation="ModelExchange" source=')),
        "only CoSimulation is supported",
    ),
    "step": (system(component("a", step="fast")), "step = 'fast' of <Component> is not a number"),
    "negative step": (system(component("a", step="-1")), "is not positive"),
    "annotation": (
        system(component("a").replace("own:Component step", "own:Component stepp")),
        "'stepp' in the annotation org.tlpsim is not one of step, inputsAt, outputs",
    ),
    "dictionary": (system('<ssd:SignalDictionaryReference name="d" dictionary="x"/>'), "'d' is not supported"),
    "element": (system(PAIR, connection("a.y", "bb.u")), "no element 'bb'"),
    "both give": (system(PAIR, connection("a.y", "b.y")), "both ends give a value (output, output)"),
    "fed twice": (system(PAIR, connection("a.y", "b.u") * 2), "'b.u' is already fed by 'a.y'"),
    "system connector": (
        system(PAIR, connection("inn", "a.u"), connectors("in:input")),
        "has no connector 'inn'; nearest match: 'in'",
    ),
    "kind": (system(PAIR, connection("in", "a.u"), connectors("in:inout")), "is of the kind 'inout'"),
    "table": (
        system(PAIR, connection("a.y", "b.u", "<ssc:BooleanMappingTransformation/>")),
        "<BooleanMappingTransformation> is not supported",
    ),
    "factor": (
        system(PAIR, connection("a.y", "b.u", '<ssc:LinearTransformation factor="two"/>')),
        "factor = 'two' of <LinearTransformation> is not a number",
    ),
    "flag": (
        system(PAIR, connection("a.y", "b.u", more='suppressUnitConversion="yes"')),
        "suppressUnitConversion of <Connection> = 'yes' is not true or false",
    ),
    "value": (system(component("a", inline(real("gain", "big")))), "parameter 'gain': 'big' is not of the type Real"),
    "no value": (system(component("a", inline('<ssv:Parameter name="k"/>'))), "parameter 'k': it has no value"),
    "binary": (
        system(component("a", inline('<ssv:Parameter name="k"><ssv:Binary value="00"/></ssv:Parameter>'))),
        "values of the type Binary are not supported",
    ),
    "unit": (
        system(component("a", inline(real("gain", 1.0, "N")))),
        "'a.gain' takes m: N is of the dimension kg.m.s-2 and m of m; correct the unit",
    ),
    "mapping": (
        system(component("a", inline(real("k", 1.0), '<ssm:MappingEntry source="kk" target="gain"/>'))),
        "no parameter 'kk' to map to 'gain'; the set has k",
    ),
    "source base": (
        system(component("a", inline(real("k", 1.0), more='sourceBase="component"'))),
        "has sourceBase = 'component'; put the file beside the description",
    ),
    "depth": ('<ssd:System name="x"><ssd:Elements>' * 102 + "</ssd:Elements></ssd:System>" * 102, "more than 100 deep"),
    "circle": (
        system(
            component("a")
            + system(
                component("b"),
                connection("in", "out") + connection("back", "b.u") + connection("in2", "back2"),
                connectors("in:input", "out:output", "back:input", "in2:input", "back2:output"),
                "inner",
            ),
            connection("inner.out", "inner.in2")
            + connection("inner.back2", "inner.in")
            + connection("inner.out", "inner.back"),
        ),
        "feed each other in a circle",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_is_malformed_is_told_in_one_line(read: Callable[..., SystemDescription], fault: str) -> None:
    text, message = FAULTS[fault]
    with pytest.raises(TlpsimError) as caught:
        read(text)
    assert message in str(caught.value)
    assert "system.ssd" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<a>", "the XML cannot be parsed"),
        ('<!DOCTYPE a [<!ENTITY x SYSTEM "file:///etc/passwd">]><a>&x;</a>', "the XML has a DOCTYPE"),
        ("<a/>", "the document is <a>, not <SystemStructureDescription>"),
        (
            HEAD.replace('version="1.0"', 'version="9"') + "</ssd:SystemStructureDescription>",
            "version = '9' is not one",
        ),
    ],
)
def test_what_is_no_description(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "system.ssd").write_text(text)
    with pytest.raises(SspError, match=message):
        read_ssp(tmp_path / "system.ssd", gain)


def test_files_that_are_missing_or_no_packages(tmp_path: Path) -> None:
    with pytest.raises(SspError, match="no such file"):
        read_ssp(tmp_path / "none.ssp", gain)
    with pytest.raises(SspError, match=r"give an \.ssp or an \.ssd file"):
        read_ssp(tmp_path / "none.zip", gain)
    (tmp_path / "text.ssp").write_text("text")
    with pytest.raises(SspError, match="is not a zip archive"):
        read_ssp(tmp_path / "text.ssp", gain)
    with zipfile.ZipFile(tmp_path / "empty.ssp", "w"):
        pass
    with pytest.raises(SspError, match=r"the archive has no SystemStructure\.ssd"):
        read_ssp(tmp_path / "empty.ssp", gain)


def test_a_package_keeps_to_itself(tmp_path: Path) -> None:
    (tmp_path / "a.fmu").touch()
    text = HEAD + system(component("a").replace("a.fmu", f"..%2F{tmp_path.name}/a.fmu"))
    with zipfile.ZipFile(tmp_path / "p.ssp", "w") as package:
        package.writestr("SystemStructure.ssd", text + "</ssd:SystemStructureDescription>")
    with pytest.raises(SspError, match="leads out of the package"):
        read_ssp(tmp_path / "p.ssp", gain)


def test_units_are_converted_on_the_way(read: Callable[..., SystemDescription]) -> None:
    """y = 500 u with the input in kN: 3 kN are 1.5 kN at the next component, in N times 1e-3."""
    wire = connection("a.y", "b.u", linear(1.0, 0.25))
    found = read(system(component("a", inline(real("u", 3.0) + real("gain", 500.0))) + component("b"), wire))
    recorder = MemoryRecorder()
    run(found.system, SECOND, observers=[recorder])
    np.testing.assert_array_equal(recorder.signal("b", "y"), np.full(11, 1.75))
