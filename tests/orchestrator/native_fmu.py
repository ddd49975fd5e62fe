"""A native FMU for tests and benchmarks, compiled from `native/chain.h` by the system's C compiler.

Import it by `from native_fmu import build`: pytest has this folder on its path; any other program puts it there first,
`sys.path.insert(0, "tests/orchestrator")`. The FMU `Chain` has Real inputs ``u[1]`` … ``u[6]`` and outputs ``y[1]`` …
``y[12]``. Output k follows y' = k u - y with u = ``u[1 + (k - 1) % 6]`` by the backward Euler method:
y(t + h) = (y(t) + h k u) / (1 + h), with the input that is set before the step. The FMI 3.0 build has the arrays `u`
and `y`, and of every other numeric type an input ``int8_in`` and an output ``int8`` that shows it; the FMI 2.0 build
has ``count_in``, ``count`` (Integer), ``flag_in`` and ``flag`` (Boolean) instead.

Parameters: `label` (String), and `fault`, one of `FAULTS`, which happens in every step that ends at `fault_time` (s) or
later and is longer than `fault_step` (s, 0 by default).
"""

import hashlib
import shutil
import subprocess
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

import fmpy

SOURCES = Path(__file__).parent / "native"
COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
NO_COMPILER = "no C compiler (cc, gcc or clang) on the PATH"

_NAMES = "none segfault hang exit fatal nan error discard warning print early_return terminate pending"
FAULTS = dict(zip(_NAMES.split(), range(13), strict=True))
"""Values of the parameter `fault`; early_return is of FMI 3.0 and pending of FMI 2.0 only."""

_TYPES = ("Float32", "Int8", "UInt8", "Int16", "UInt16", "UInt32", "Int64", "UInt64", "Boolean", "Int32")


def _description2(guid: str, inputs: int, outputs: int, derivatives: int) -> str:
    def scalar(name: str, reference: int, causality: str, variability: str, typed: str) -> str:
        return (
            f'<ScalarVariable name="{name}" valueReference="{reference}" causality="{causality}" '
            f'variability="{variability}">{typed}</ScalarVariable>'
        )

    variables = [
        *(scalar(f"u[{k + 1}]", 100 + k, "input", "continuous", '<Real unit="N" start="0"/>') for k in range(inputs)),
        *(scalar(f"y[{k + 1}]", 100000 + k, "output", "continuous", '<Real unit="m"/>') for k in range(outputs)),
        scalar("label", 1, "parameter", "fixed", '<String start=""/>'),
        scalar("fault", 2, "parameter", "fixed", '<Integer start="0"/>'),
        scalar("fault_time", 3, "parameter", "fixed", '<Real unit="s" start="0"/>'),
        scalar("fault_step", 4, "parameter", "fixed", '<Real unit="s" start="0"/>'),
        scalar("count_in", 5, "input", "discrete", '<Integer start="0"/>'),
        scalar("count", 6, "output", "discrete", "<Integer/>"),
        scalar("flag_in", 7, "input", "discrete", '<Boolean start="false"/>'),
        scalar("flag", 8, "output", "discrete", "<Boolean/>"),
    ]
    unknowns = "".join(
        f'<Unknown index="{inputs + k + 1}" dependencies="{1 + k % inputs}"/>' for k in range(outputs)
    ) + "".join(f'<Unknown index="{inputs + outputs + k}" dependencies="{inputs + outputs + k - 1}"/>' for k in (6, 8))
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Chain" guid="{guid}" generationTool="C compiler">
<CoSimulation modelIdentifier="Chain" maxOutputDerivativeOrder="{derivatives}"
 canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true"
 canSerializeFMUstate="true"/>
<UnitDefinitions>
<Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit>
<Unit name="m"><BaseUnit m="1"/></Unit>
<Unit name="s"><BaseUnit s="1"/></Unit>
</UnitDefinitions>
<ModelVariables>{"".join(variables)}</ModelVariables>
<ModelStructure><Outputs>{unknowns}</Outputs><InitialUnknowns>{unknowns}</InitialUnknowns></ModelStructure>
</fmiModelDescription>"""


def _description3(guid: str, inputs: int, outputs: int, derivatives: int) -> str:
    def others(suffix: str, first: int, causality: str, start: bool) -> str:
        return "".join(
            f'<{name} name="{name.lower()}{suffix}" valueReference="{first + number}" causality="{causality}" '
            f'variability="discrete"{(" start=" + repr("false" if name == "Boolean" else "0")) if start else ""}/>'
            for number, name in enumerate(_TYPES)
        )

    unknowns = '<Output valueReference="6" dependencies="5"/>' + "".join(
        f'<Output valueReference="{40 + k}" dependencies="{20 + k}"/>' for k in range(len(_TYPES))
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Chain" instantiationToken="{guid}" generationTool="C compiler">
<CoSimulation modelIdentifier="Chain" maxOutputDerivativeOrder="{derivatives}"
 canHandleVariableCommunicationStepSize="true" canGetAndSetFMUState="true"
 canSerializeFMUState="true"/>
<UnitDefinitions>
<Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit>
<Unit name="m"><BaseUnit m="1"/></Unit>
<Unit name="s"><BaseUnit s="1"/></Unit>
</UnitDefinitions>
<ModelVariables>
<Float64 name="time" valueReference="0" causality="independent" variability="continuous" unit="s"/>
<UInt64 name="outputs" valueReference="60" causality="structuralParameter" variability="fixed" start="{outputs}"/>
<Float64 name="u" valueReference="5" causality="input" unit="N" start="0">
<Dimension start="{inputs}"/></Float64>
<Float64 name="y" valueReference="6" causality="output" unit="m"><Dimension valueReference="60"/></Float64>
<String name="label" valueReference="1" causality="parameter" variability="fixed"><Start value=""/></String>
<Int32 name="fault" valueReference="2" causality="parameter" variability="fixed" start="0"/>
<Float64 name="fault_time" valueReference="3" causality="parameter" variability="fixed" unit="s" start="0"/>
<Float64 name="fault_step" valueReference="4" causality="parameter" variability="fixed" unit="s" start="0"/>
{others("_in", 20, "input", True)}
{others("", 40, "output", False)}
</ModelVariables>
<ModelStructure>{unknowns}{unknowns.replace("<Output", "<InitialUnknown")}</ModelStructure>
</fmiModelDescription>"""


_DESCRIPTIONS = {2: _description2, 3: _description3}


def build(folder: str | Path, version: int = 2, inputs: int = 6, outputs: int = 12, derivatives: int = 0) -> Path:
    """Compile the FMU for this platform.

    Parameters
    ----------
    folder
        Where to put it.
    version
        Of FMI, 2 or 3.
    inputs, outputs
        Numbers of Real inputs and outputs.
    derivatives
        Order up to which derivatives of the outputs are offered, by the equations of the states.

    Returns
    -------
    Path of the FMU.

    Raises
    ------
    RuntimeError
        Without a C compiler; tests are skipped by the fixture `chain_fmu` then.
    """
    path = Path(folder) / f"Chain_fmi{version}_{inputs}_{outputs}{f'_{derivatives}' if derivatives else ''}.fmu"
    macros = {"INPUTS": inputs, "OUTPUTS": outputs}
    made = _DESCRIPTIONS[version]
    return compiled(path, "Chain", version, lambda guid: made(guid, inputs, outputs, derivatives), macros)


def compiled(
    path: Path, model: str, version: int, description: Callable[[str], str], macros: Mapping[str, int]
) -> Path:
    """Compile a model of the folder `native` into an FMU: ``MODEL.h`` with ``MODEL2.c`` or ``MODEL3.c``.

    Parameters
    ----------
    path
        Of the FMU.
    model
        Its model identifier; the sources have its name in small letters.
    version
        Of FMI, 2 or 3.
    description
        Function of the guid that gives modelDescription.xml.
    macros
        Of the preprocessor, beside GUID.

    Returns
    -------
    Path of the FMU.

    Raises
    ------
    RuntimeError
        Without a C compiler.
    """
    if COMPILER is None:
        raise RuntimeError(NO_COMPILER)
    sources = [SOURCES / f"{model.lower()}{ending}" for ending in (".h", f"{version}.c")]
    texts = [source.read_bytes() for source in sources]
    guid = hashlib.sha256(b"".join([*texts, repr(sorted(macros.items())).encode()])).hexdigest()
    library = path.with_suffix(fmpy.sharedLibraryExtension)
    headers = Path(fmpy.__file__).parent / "c-code"
    command = [COMPILER, "-O2", "-fPIC", "-shared", "-std=gnu11", f"-I{headers}", str(sources[1]), "-o", str(library)]
    command += [f"-D{name}={value}" for name, value in macros.items()] + [f'-DGUID="{guid}"', "-lm"]
    subprocess.run(command, check=True, capture_output=True, text=True)
    platform = fmpy.platform if version == 2 else fmpy.platform_tuple
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", description(guid))
        archive.write(library, f"binaries/{platform}/{model}{fmpy.sharedLibraryExtension}")
    library.unlink()
    return path
