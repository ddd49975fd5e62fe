"""Hulls from files: a HULL.toml of a parametric hull, or the mesh file of another code.

    [hull]   kind = "tlp", "semisubmersible", "cylinder", "box" or "hemisphere"; its lengths; panel, their size
    [body]   mass, centre_of_gravity, radii_of_gyration or inertia, stiffness: what moves with the hull, and what
             holds it beside the water; for response amplitudes and the drift of a moving body

Mesh files are WAMIT's .gdf, NEMOH's .dat and .mar, and .stl of the wetted surface.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, Field, ValidationError, create_model, model_validator

from tlpsim.loads.bem import hulls
from tlpsim.loads.bem.hydrostatics import hydrostatics, weight_stiffness
from tlpsim.loads.bem.mesh import (
    Mesh,
    faults,
    flaws,
    panels,
    read_gdf,
    read_nemoh,
    read_stl,
    volumes,
    waterline_loops,
    whole,
)
from tlpsim.loads.bem.semisubmersible import SemisubmersibleHull, semisubmersible
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.rigid_body import mass_matrix
from tlpsim.scenarios.problems import Location, Source, nearest, problem, scenario_error
from tlpsim.scenarios.quantities import MASS, Length, PositiveLength
from tlpsim.scenarios.reading import read_toml
from tlpsim.scenarios.sections import Section

FloatArray = NDArray[np.float64]

_SYMMETRY_TOLERANCE = 1e-3
_WEIGHT_TOLERANCE = 0.02
_LID_TOLERANCE = 0.02

Mass = Annotated[float, BeforeValidator(MASS.parse), Field(gt=0)]
Matrix = tuple[tuple[float, ...], ...]


class _Hull(Section):
    """Keys that all kinds share."""

    kind: str
    panel: PositiveLength


class _Tlp(_Hull):
    """Four round columns and four rectangular pontoons, on a square."""

    spacing: PositiveLength
    column_radius: PositiveLength
    draft: PositiveLength
    pontoon_width: PositiveLength
    pontoon_height: PositiveLength


class _Semisubmersible(_Hull):
    """Two rectangular pontoons along x and round columns on them."""

    pontoon_length: PositiveLength
    pontoon_width: PositiveLength
    pontoon_height: PositiveLength
    pontoon_spacing: PositiveLength
    column_radius: PositiveLength
    column_positions: Annotated[tuple[Length, ...], Field(min_length=1)]
    draft: PositiveLength


class _Cylinder(_Hull):
    """Upright cylinder."""

    radius: PositiveLength
    draft: PositiveLength


class _Box(_Hull):
    """Box of length along x and beam along y."""

    length: PositiveLength
    beam: PositiveLength
    draft: PositiveLength


class _Hemisphere(_Hull):
    """Half a sphere, its centre on the still water level."""

    radius: PositiveLength


class _Body(Section):
    """Body that moves with the hull."""

    mass: Mass
    centre_of_gravity: tuple[Length, Length, Length]
    radii_of_gyration: tuple[PositiveLength, PositiveLength, PositiveLength] | None = None
    inertia: tuple[float, ...] | Matrix | None = None
    stiffness: tuple[float, ...] | Matrix | None = None

    @model_validator(mode="after")
    def _whole(self) -> _Body:
        if (self.radii_of_gyration is None) == (self.inertia is None):
            text = "one of radii_of_gyration and inertia is wanted, about the centre of gravity"
            raise problem(("inertia",), self.inertia, text)
        for name, size in (("inertia", 3), ("stiffness", 6)):
            given = getattr(self, name)
            widths = [len(row) if isinstance(row, tuple) else 0 for row in given or (0,) * size]
            if widths not in ([0] * size, [size] * size):
                raise problem((name,), given, f"must be {size} numbers or {size} lists of {size}")
        return self


def _tlp(hull: Any, coarse: bool) -> Mesh:
    return hulls.tlp(hulls.TlpHull(**_lengths(hull)), hull.panel, coarse=coarse)


def _semisubmersible(hull: Any, coarse: bool) -> Mesh:
    return semisubmersible(SemisubmersibleHull(**_lengths(hull)), hull.panel, coarse=coarse)


def _cylinder(hull: Any, coarse: bool) -> Mesh:
    quarter = 0.5 * np.pi * hull.radius
    lengths = (quarter, hull.draft, hull.radius)
    around, down, across = (hulls.even_count(length, hull.panel, coarse) for length in lengths)
    return hulls.cylinder(hull.radius, hull.draft, around, down, across)


def _box(hull: Any, coarse: bool) -> Mesh:
    return hulls.box(hull.length, hull.beam, hull.draft, hull.panel, coarse)


def _hemisphere(hull: Any, coarse: bool) -> Mesh:
    count = hulls.even_count(0.5 * np.pi * hull.radius, hull.panel, coarse)
    return hulls.hemisphere(hull.radius, count, count)


def _lengths(hull: _Hull) -> dict[str, Any]:
    return hull.model_dump(exclude={"kind", "panel"})


KINDS: Mapping[str, tuple[type[_Hull], Callable[[Any, bool], Mesh]]] = {
    "tlp": (_Tlp, _tlp),
    "semisubmersible": (_Semisubmersible, _semisubmersible),
    "cylinder": (_Cylinder, _cylinder),
    "box": (_Box, _box),
    "hemisphere": (_Hemisphere, _hemisphere),
}
"""Kind of hull -> its keys and its mesh, the fine one or one with panels twice as large."""

READERS: Mapping[str, Callable[[str | Path], Mesh]] = {
    ".gdf": read_gdf,
    ".dat": read_nemoh,
    ".mar": read_nemoh,
    ".stl": read_stl,
}
"""Suffix of a mesh file -> its reader."""

PLANES: Mapping[str, tuple[str, ...]] = {"x": ("x",), "y": ("y",), "xy": ("x", "y")}
"""What `symmetry` may be -> planes of symmetry."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """Body that moves with the hull: kg, (3,) m, (3, 3) kg m² about the centre of gravity, (6, 6) N/m, N, N m.

    `stiffness` is of all that holds the body beside buoyancy and weight, about the origin.
    """

    mass: float
    centre_of_gravity: FloatArray
    inertia: FloatArray
    stiffness: FloatArray

    def mass_matrix(self) -> FloatArray:
        """(6, 6) about the origin."""
        return mass_matrix(self.mass, self.centre_of_gravity, self.inertia)

    def total_stiffness(self, mesh: Mesh, density: float, gravity: float) -> FloatArray:
        """(6, 6) of buoyancy, weight and all that holds the body."""
        still = hydrostatics(mesh, density, gravity).stiffness
        return still + weight_stiffness(self.mass, self.centre_of_gravity, gravity) + self.stiffness


@dataclass(frozen=True, slots=True, kw_only=True)
class Hull:
    """A hull as read: mesh, lid (None without a water plane), body (None for a fixed one), and the coarser mesh.

    `coarse` has panels twice as large, to tell the error of the mesh by; None for a mesh file.
    """

    mesh: Mesh
    lid: Mesh | None
    body: Body | None
    coarse: Mesh | None


def read_hull(path: Path, panel: float | None = None, symmetry: str | None = None) -> Hull:
    """Read a HULL.toml or a mesh file.

    Parameters
    ----------
    path
        File; its suffix tells what it is.
    panel
        Size of the panels in m, instead of that in HULL.toml.
    symmetry
        "x", "y" or "xy": planes of symmetry of the body in a mesh file, of which one part is then kept.

    Raises
    ------
    ScenarioError
        If the file cannot be read, or is not what its suffix says.
    """
    suffix = path.suffix.lower()
    if not path.is_file():
        raise ScenarioError(f"{path}: no such file; give a HULL.toml or a mesh: {', '.join(READERS)}")
    if suffix == ".toml":
        if symmetry is not None:
            raise ScenarioError(f"--symmetry is for mesh files: the hulls of {path} are made with their symmetry")
        return _read_toml(path, panel)
    if suffix not in READERS:
        known = ", ".join([".toml", *READERS])
        raise ScenarioError(f"{path}: '{path.suffix}' is no suffix of a hull{nearest(suffix, READERS)}; known: {known}")
    if panel is not None:
        raise ScenarioError(f"--panel is for a HULL.toml: the panels of {path} are what they are")
    mesh = READERS[suffix](path)
    if symmetry is not None:
        mesh = with_symmetry(mesh, symmetry)
    return Hull(mesh=mesh, lid=None if np.mean(volumes(mesh)) <= 0.0 else lid_of(mesh), body=None, coarse=None)


def _read_toml(path: Path, panel: float | None) -> Hull:
    data = read_toml(path)
    section = data.get("hull")
    if not isinstance(section, Mapping):
        raise ScenarioError(f'{path}: [hull] is missing: write [hull] with kind = "tlp", its lengths and panel')
    kind = section.get("kind")
    if kind not in KINDS:
        told = f"kind = {kind!r}: must be" if "kind" in section else "kind is missing: it must be"
        raise ScenarioError(f"{path}: hull.{told} one of {', '.join(KINDS)}{nearest(str(kind), KINDS)}")
    keys, make = KINDS[str(kind)]
    model = create_model("HullFile", __base__=Section, hull=(keys, ...), body=(_Body | None, None))
    sections: dict[Location, type[BaseModel]] = {(): model, ("hull",): keys, ("body",): _Body}
    sources = [Source(name=str(path), data=data)]
    if panel is not None:
        data = {**data, "hull": {**section, "panel": panel}}
        sources.append(Source(name="--panel", data={"hull": {"panel": panel}}))
    try:
        read: Any = model.model_validate(data)
    except ValidationError as error:
        raise scenario_error(error, sources, sections) from None
    mesh, coarse = make(read.hull, False), make(read.hull, True)
    body = None if read.body is None else _body(path, read.body)
    return Hull(mesh=mesh, lid=lid_of(mesh), body=body, coarse=coarse)


def _body(path: Path, read: _Body) -> Body:
    if read.radii_of_gyration is not None:
        inertia = read.mass * np.diag(np.square(read.radii_of_gyration))
    else:
        inertia = _square(read.inertia, 3)
    stiffness = _square(read.stiffness, 6)
    for name, matrix in (("inertia", inertia), ("stiffness", stiffness)):
        if not np.all(np.isfinite(matrix)):
            raise ScenarioError(f"{path}: body.{name} holds a number that is not finite; give finite ones")
    if np.min(np.linalg.eigvalsh(0.5 * (inertia + inertia.T))) <= 0.0:
        raise ScenarioError(f"{path}: body.inertia is not positive definite; check its signs and units (kg m²)")
    centre = np.array(read.centre_of_gravity, dtype=np.float64)
    return Body(mass=read.mass, centre_of_gravity=centre, inertia=inertia, stiffness=stiffness)


def _square(given: object, size: int) -> FloatArray:
    array = np.zeros(size) if given is None else np.array(given, dtype=np.float64)
    return np.diag(array) if array.ndim == 1 else array


def lid_of(mesh: Mesh) -> Mesh | None:
    """Lid on the water planes of a mesh; None where there is none, or one is not star-shaped or has a hole in it."""
    if len(waterline_loops(mesh)) == 0:
        return None
    lid = hulls.lid(mesh)
    covered = float(np.sum(panels(whole(lid)).area)) / hulls.LID_REACH**2
    area = hydrostatics(mesh).waterplane_area
    return lid if abs(covered - area) < _LID_TOLERANCE * area else None


def with_symmetry(mesh: Mesh, symmetry: str) -> Mesh:
    """The part of a body on the positive side of its planes of symmetry ("x", "y" or "xy").

    A mesh that lies on that side altogether is taken for the part; of another one the rest is left out.

    Raises
    ------
    ScenarioError
        If a panel crosses a plane, or the body is not symmetric.
    """
    if symmetry not in PLANES:
        raise ScenarioError(f"--symmetry is '{symmetry}'; it must be x, y or xy: the coordinates that may be mirrored")
    planes = PLANES[symmetry]
    complete = whole(mesh)
    tolerance = 1e-6 * float(np.max(np.ptp(complete.vertices.reshape(-1, 3), axis=0)))
    part, cut = complete.vertices, False
    for axis, plane in enumerate(("x", "y")):
        if plane not in planes:
            continue
        lowest, highest = part[:, :, axis].min(axis=1), part[:, :, axis].max(axis=1)
        if np.any((lowest < -tolerance) & (highest > tolerance)):
            raise ScenarioError(f"mesh '{mesh.name}': a panel crosses {plane} = 0; leave {plane} out of --symmetry")
        cut = cut or bool(np.any(lowest < -tolerance))
        part = part[highest > tolerance]
    if len(part) == 0:
        raise ScenarioError(f"mesh '{mesh.name}': no panel lies on the positive side of {symmetry}; mirror the file")
    result = Mesh(name=mesh.name, vertices=np.where(np.abs(part) < tolerance, 0.0, part), planes=planes)
    if cut:
        for name, measure in (("volume", _volume), ("wetted area", _area), ("centroid", _centroid)):
            before, after = measure(complete), measure(result)
            scale = np.max(np.abs(before)) if name != "centroid" else 1e6 * tolerance
            if np.max(np.abs(after - before)) > _SYMMETRY_TOLERANCE * scale:
                raise ScenarioError(
                    f"mesh '{mesh.name}' is not symmetric in {symmetry}: its {name} would change from "
                    f"{np.round(before, 3)} to {np.round(after, 3)}; leave --symmetry out"
                )
    return result


def _volume(mesh: Mesh) -> FloatArray:
    return volumes(mesh)


def _area(mesh: Mesh) -> FloatArray:
    return np.array([np.sum(panels(whole(mesh)).area)])


def _centroid(mesh: Mesh) -> FloatArray:
    geometry = panels(whole(mesh))
    return np.asarray(geometry.area @ geometry.centre / np.sum(geometry.area))


def checked(hull: Hull, shortest_wave: float, density: float) -> list[str]:
    """Warnings about a hull that can be solved for waves down to a length in m.

    Raises
    ------
    ScenarioError
        If the mesh is broken; the message has the remedies.
    """
    if broken := faults(hull.mesh):
        raise ScenarioError("; and ".join(broken))
    findings = flaws(hull.mesh, shortest_wave)
    if hull.body is not None:
        displaced = density * float(np.mean(volumes(hull.mesh)))
        held = bool(np.any(hull.body.stiffness))
        if abs(hull.body.mass - displaced) > _WEIGHT_TOLERANCE * displaced and not held:
            findings.append(
                f"the body of {hull.body.mass:.4g} kg floats in {displaced:.4g} kg of water; "
                "give the stiffness of what holds it, or another mass"
            )
    return findings
