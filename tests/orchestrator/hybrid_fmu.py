"""A native model-exchange FMU with events for tests, compiled from `native/hybrid.h`, which says what it computes."""

from pathlib import Path

from native_fmu import compiled

STATES = ("x", "h", "v")
_REALS = {
    "x": ("output", "continuous", 1.0),
    "h": ("output", "continuous", 1.0),
    "v": ("output", "continuous", 0.0),
    "u": ("input", "continuous", 0.0),
    **{
        name: ("parameter", "fixed", start)
        for name, start in (
            ("gain", 1.0),
            ("g", 9.81),
            ("restitution", 1.0),
            ("period", 1e300),
            ("step_event", 1e300),
            ("fault_time", 1e300),
        )
    },
}
_INTEGERS = {
    "fault": ("parameter", "fixed", 0),
    "level": ("input", "discrete", 0),
    **{name: ("output", "discrete", None) for name in ("ticks", "bounces", "changes", "steps")},
}
FAULTS = {name: number for number, name in enumerate(["none", "nan", "terminate", "chatter", "discard", "fatal"])}


def _rows() -> list[tuple[str, int, str, str, float | None, str, int | None]]:
    """Name, value reference, causality, variability, start, type, and reference of the state of a derivative."""
    rows = [(name, k, *row, "Real", None) for k, (name, row) in enumerate(_REALS.items())]
    rows += [(f"der({name})", 20 + k, "local", "continuous", None, "Real", k) for k, name in enumerate(STATES)]
    rows += [("y", 30, "output", "continuous", None, "Real", None)]
    rows += [(name, 40 + k, *row, "Integer", None) for k, (name, row) in enumerate(_INTEGERS.items())]
    return rows


def _description2(guid: str) -> str:
    rows = _rows()
    variables = ""
    for name, reference, causality, variability, start, kind, state in rows:
        attributes = "" if start is None else f' start="{start}"'
        attributes += "" if state is None else f' derivative="{state + 1}"'
        initial = ' initial="exact"' if name in STATES else ""
        variables += (
            f'<ScalarVariable name="{name}" valueReference="{reference}" causality="{causality}" '
            f'variability="{variability}"{initial}><{kind}{attributes}/></ScalarVariable>\n'
        )
    places = {row[0]: number for number, row in enumerate(rows, 1)}
    outputs = "".join(f'<Unknown index="{places[row[0]]}"/>' for row in rows if row[2] == "output")
    derivatives = "".join(f'<Unknown index="{places[f"der({name})"]}"/>' for name in STATES)
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Hybrid" guid="{guid}" numberOfEventIndicators="2">
<ModelExchange modelIdentifier="Hybrid" canGetAndSetFMUstate="true" canSerializeFMUstate="true"/>
<ModelVariables>{variables}</ModelVariables>
<ModelStructure><Outputs>{outputs}</Outputs><Derivatives>{derivatives}</Derivatives></ModelStructure>
</fmiModelDescription>"""


def _description3(guid: str) -> str:
    rows = _rows()
    variables = '<Float64 name="time" valueReference="99" causality="independent" variability="continuous"/>\n'
    for name, reference, causality, variability, start, kind, state in rows:
        attributes = "" if start is None else f' start="{start}"'
        attributes += "" if state is None else f' derivative="{state}"'
        initial = ' initial="exact"' if name in STATES else ""
        variables += (
            f'<{"Float64" if kind == "Real" else "Int32"} name="{name}" valueReference="{reference}" '
            f'causality="{causality}" variability="{variability}"{initial}{attributes}/>\n'
        )
    for k in range(2):
        variables += f'<Float64 name="z[{k}]" valueReference="{60 + k}" causality="local" variability="continuous"/>\n'
    outputs = "".join(f'<Output valueReference="{row[1]}"/>' for row in rows if row[2] == "output")
    derivatives = "".join(f'<ContinuousStateDerivative valueReference="{20 + k}"/>' for k in range(len(STATES)))
    indicators = "".join(f'<EventIndicator valueReference="{60 + k}"/>' for k in range(2))
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="Hybrid" instantiationToken="{guid}">
<ModelExchange modelIdentifier="Hybrid" needsCompletedIntegratorStep="true"/>
<ModelVariables>{variables}</ModelVariables>
<ModelStructure>{outputs}{derivatives}{indicators}</ModelStructure>
</fmiModelDescription>"""


def build(folder: str | Path, version: int = 2) -> Path:
    """Compile the FMU for a version of FMI; see `native_fmu.compiled`."""
    description = _description2 if version == 2 else _description3
    return compiled(Path(folder) / f"Hybrid_fmi{version}.fmu", "Hybrid", version, description, {})
