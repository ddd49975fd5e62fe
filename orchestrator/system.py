"""Components, connections, and what can be said of a system before anything runs: errors, notes, loops."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from tlpsim.loads.errors import WiringError
from tlpsim.loads.filters.interpolation import CAUSAL, SYMMETRIC
from tlpsim.orchestrator.instance import Instance, Variable, nearest_match

INPUTS_AT = ("end", "middle", "start")
"""Where in its step a component's inputs are evaluated."""

EXTRAPOLATIONS = ("derivatives", "hold", "linear", "quadratic")
"""How a signal is continued beyond its newest sample."""

_MEMBER = re.compile(r"(?<=\[)\d+(?=\])|(?<=\.)[^.\[\]]+$")
"""The number of an element, or the last part of a structured name: what the members of a family differ in."""
_MOST_NAMED = 3
_NO_PARAMETERS: Mapping[str, object] = MappingProxyType({})


@dataclass(frozen=True, slots=True, kw_only=True)
class Component:
    """An instance in a system, with a step size of its own.

    Parameters
    ----------
    instance
        What is stepped; its name is the component's name.
    step
        Step in ns.
    parameters
        Parameters, and start values of inputs, by variable name.
    inputs_at
        Instant within a step for which the inputs are evaluated: ``end``, ``middle`` or ``start``.
    outputs
        Outputs that observers get, in this order; None for all Real outputs. Connected outputs that are not
        among them come after them.
    """

    instance: Instance
    step: int
    parameters: Mapping[str, object] = field(default_factory=lambda: _NO_PARAMETERS)
    inputs_at: str = "end"
    outputs: tuple[str, ...] | None = None

    @property
    def name(self) -> str:
        """Name of the component."""
        return self.instance.name


@dataclass(frozen=True, slots=True, kw_only=True)
class Connection:
    """A signal from an output of one component to an input of another.

    Parameters
    ----------
    source, source_variable
        Component and output that the signal comes from.
    target, target_variable
        Component and input that it goes to.
    filter
        How values between samples are found: ``hold``, ``linear``, ``cubic`` or ``quintic``, and outside
        loops also ``six_point``, ``kaiser`` or ``optimal``, which have no causal form.
    extrapolation
        How values beyond the newest sample are found, which only happens in loops: ``hold``, ``linear`` or
        ``quadratic`` through the newest samples, or ``derivatives``: the derivatives up to second order
        that the source declares, and linear where it declares none.
    """

    source: str
    source_variable: str
    target: str
    target_variable: str
    filter: str = "cubic"
    extrapolation: str = "derivatives"

    def __str__(self) -> str:
        return f"{self.source}.{self.source_variable} -> {self.target}.{self.target_variable}"


@dataclass(frozen=True, slots=True, kw_only=True)
class System:
    """Components and their connections."""

    components: tuple[Component, ...]
    connections: tuple[Connection, ...] = ()


def _component(by_name: Mapping[str, Component], name: str, connection: Connection) -> Component:
    if name not in by_name:
        raise WiringError(f"connection {connection}: no component '{name}'{nearest_match(name, by_name)}")
    return by_name[name]


def _variable(component: Component, name: str, causality: str, where: str) -> Variable:
    """Return a Real variable of the wanted causality, or raise."""
    variables = component.instance.variables
    if name not in variables:
        alike = [key for key, variable in variables.items() if variable.causality == causality]
        near = nearest_match(name, alike) or nearest_match(name, variables)
        raise WiringError(f"{where}: component '{component.name}' has no variable '{name}'{near}")
    variable = variables[name]
    if variable.causality != causality:
        raise WiringError(
            f"{where}: '{component.name}.{name}' has the causality {variable.causality}, not {causality}; "
            "connect an output to an input"
        )
    if variable.type != "Real":
        raise WiringError(
            f"{where}: '{component.name}.{name}' is of the type {variable.type}; only Real can be connected"
        )
    return variable


def _unit(text: str | None) -> str:
    """Normalise the spelling of a product; dimensionless units count as undeclared."""
    plain = (text or "").replace(" ", "").replace("*", ".").replace("·", ".")
    return "" if plain in ("1", "-") else plain


def _check_component(component: Component) -> None:
    name = component.name
    if not isinstance(component.step, int) or component.step <= 0:
        raise WiringError(f"component '{name}': step {component.step!r} is not a positive whole number of ns")
    if component.inputs_at not in INPUTS_AT:
        raise WiringError(
            f"component '{name}': inputs_at = '{component.inputs_at}' is not one of {', '.join(INPUTS_AT)}"
        )
    for output in component.outputs or ():
        _variable(component, output, "output", f"outputs of component '{name}'")


def _check_connection(connection: Connection, by_name: Mapping[str, Component]) -> None:
    where = f"connection {connection}"
    source = _component(by_name, connection.source, connection)
    target = _component(by_name, connection.target, connection)
    output = _variable(source, connection.source_variable, "output", where)
    into = _variable(target, connection.target_variable, "input", where)
    if _unit(output.unit) and _unit(into.unit) and _unit(output.unit) != _unit(into.unit):
        raise WiringError(f"{where}: the output is in {output.unit} and the input in {into.unit}; connect like units")
    if connection.filter not in SYMMETRIC:
        raise WiringError(f"{where}: filter '{connection.filter}' is not one of {', '.join(SYMMETRIC)}")
    if connection.extrapolation not in EXTRAPOLATIONS:
        raise WiringError(
            f"{where}: extrapolation '{connection.extrapolation}' is not one of {', '.join(EXTRAPOLATIONS)}"
        )


def _check_look_ahead(system: System) -> None:
    """Refuse, inside a loop, filters that need samples from beyond the step."""
    group_of = {system.components[index].name: k for k, group in enumerate(groups(system)) for index in group}
    for connection in system.connections:
        if connection.filter not in CAUSAL and group_of[connection.source] == group_of[connection.target]:
            raise WiringError(
                f"connection {connection}: filter '{connection.filter}' looks ahead, which cannot be done inside the "
                f"loop of '{connection.source}' and '{connection.target}'; choose one of {', '.join(CAUSAL)}"
            )


def check(system: System) -> list[str]:
    """Check the wiring of a system.

    Returns
    -------
    Notes on what is allowed but may be an oversight, such as inputs that nothing feeds.

    Raises
    ------
    WiringError
        At the first fault: no components, a name used twice, a step that is not positive, an unknown
        component, variable, filter or extrapolation, a wrong causality or type, different units at the two
        ends, an input that is fed twice, or a filter inside a loop that has no causal form.
    """
    if not system.components:
        raise WiringError("the system has no components; give at least one")
    by_name: dict[str, Component] = {}
    for component in system.components:
        if component.name in by_name:
            raise WiringError(f"component '{component.name}' exists twice; give each one its own name")
        by_name[component.name] = component
        _check_component(component)
    fed: dict[tuple[str, str], Connection] = {}
    for connection in system.connections:
        _check_connection(connection, by_name)
        end = (connection.target, connection.target_variable)
        if end in fed:
            raise WiringError(f"connection {connection}: the input is already fed by {fed[end]}; remove one")
        fed[end] = connection
    _check_look_ahead(system)
    families: dict[str, list[str]] = {}
    for component in system.components:
        for variable in component.instance.variables.values():
            fed_here = (component.name, variable.name) in fed or variable.name in component.parameters
            if variable.causality == "input" and not fed_here:
                name = f"{component.name}.{variable.name}"
                families.setdefault(_MEMBER.sub("*", name), []).append(name)
    return [note for family, names in families.items() for note in _left_open(family, names)]


def _left_open(family: str, names: Sequence[str]) -> list[str]:
    if len(names) > _MOST_NAMED:
        return [f"{len(names)} inputs {family} are not connected and keep their start values"]
    return [f"input {name} is not connected and keeps its start value" for name in names]


def strong_components(successors: Sequence[Sequence[int]]) -> list[list[int]]:
    """Strongly connected components of a directed graph (R. Tarjan, SIAM Journal on Computing 1, 1972).

    Parameters
    ----------
    successors
        For each node, the nodes that its edges lead to.

    Returns
    -------
    The components, each before all those from which it can be reached; nodes in ascending order.
    """
    order: dict[int, int] = {}
    low: dict[int, int] = {}
    stack: list[int] = []
    result: list[list[int]] = []

    def visit(node: int) -> None:
        order[node] = low[node] = len(order)
        stack.append(node)
        for successor in successors[node]:
            if successor not in order:
                visit(successor)
                low[node] = min(low[node], low[successor])
            elif successor in stack:
                low[node] = min(low[node], order[successor])
        if low[node] == order[node]:
            position = stack.index(node)
            result.append(sorted(stack[position:]))
            del stack[position:]

    for node in range(len(successors)):
        if node not in order:
            visit(node)
    return result


def groups(system: System) -> list[list[int]]:
    """Return the indices of components that must be stepped together, sources before what they feed.

    A group is either one component outside every loop, or all components of a loop (or of loops that share
    components).
    """
    index = {component.name: number for number, component in enumerate(system.components)}
    successors: list[list[int]] = [[] for _ in system.components]
    for connection in system.connections:
        successors[index[connection.source]].append(index[connection.target])
    return strong_components(successors)[::-1]


def loops(system: System) -> list[set[str]]:
    """Return the names of the components of each loop, including components that feed themselves."""
    own = {connection.source for connection in system.connections if connection.source == connection.target}
    names = [{system.components[index].name for index in group} for group in groups(system)]
    return [group for group in names if len(group) > 1 or group & own]


def declared_derivatives(instance: Instance, name: str) -> tuple[str, ...]:
    """Return the names of a variable's declared time derivatives: none, the first, or first and second."""
    by_state = {
        variable.derivative_of: variable.name
        for variable in instance.variables.values()
        if variable.derivative_of is not None and variable.type == "Real" and variable.causality in ("output", "local")
    }
    first = by_state.get(name)
    if first is None:
        return ()
    second = by_state.get(first)
    return (first,) if second is None else (first, second)


def bound_outputs(system: System) -> list[tuple[str, ...]]:
    """Return, for each component, the outputs that are read after every step, in the order observers get
    them.

    These are the chosen outputs (all Real ones by default), then connected ones, then the declared
    derivatives that are needed to extrapolate in a loop.
    """
    group_of = {index: number for number, group in enumerate(groups(system)) for index in group}
    index = {component.name: number for number, component in enumerate(system.components)}
    result: list[tuple[str, ...]] = []
    for number, component in enumerate(system.components):
        instance = component.instance
        names = component.outputs
        if names is None:
            names = tuple(
                variable.name
                for variable in instance.variables.values()
                if variable.causality == "output" and variable.type == "Real"
            )
        chosen = dict.fromkeys(names)
        outgoing = [item for item in system.connections if item.source == component.name]
        chosen.update(dict.fromkeys(item.source_variable for item in outgoing))
        for item in outgoing:
            if item.extrapolation == "derivatives" and group_of[index[item.target]] == group_of[number]:
                chosen.update(dict.fromkeys(declared_derivatives(instance, item.source_variable)))
        result.append(tuple(chosen))
    return result
