"""Second-order wave loads: near field against far field and closed forms.

.venv/bin/python benchmarks/bem_second_order.py [--quick]
"""

from __future__ import annotations

import time

import numpy as np
from bem import issc_mass
from numpy.typing import NDArray
from report import Row, at_most, main
from scipy import special

from tlpsim.loads.bem.control_surface import control_surface
from tlpsim.loads.bem.convergence import limit
from tlpsim.loads.bem.database import Problem, compute
from tlpsim.loads.bem.discretization import Discretization, discretize
from tlpsim.loads.bem.drift_damping import wave_drift_damping
from tlpsim.loads.bem.hulls import box, cylinder, hemisphere, issc_hull, lid, tlp
from tlpsim.loads.bem.issc import issc_problem
from tlpsim.loads.bem.near_field import near_field_drift
from tlpsim.loads.bem.quadratic import FORMS, newman, quadratic_part
from tlpsim.loads.bem.quadratic_table import quadratic_table
from tlpsim.loads.bem.quadratic_transfer import mean_drift_of
from tlpsim.loads.bem.response import mean_drift, response_amplitudes
from tlpsim.loads.bem.solver import solve
from tlpsim.loads.bem.surface import SurfaceFields, hull_surface, surface_fields

FloatArray = NDArray[np.float64]

DEPTH = 450.0
HORIZONTAL = {"surge": 0, "sway": 1, "yaw": 5}
VERTICAL = {"heave": 2, "roll": 3, "pitch": 4}
LIMIT = 2.0  # %


def fields(
    body: Discretization,
    omegas: FloatArray,
    headings: FloatArray,
    mass: FloatArray,
    stiffness: FloatArray,
    density: float,
    gravity: float,
    free: bool,
) -> tuple[list[SurfaceFields], FloatArray, float]:
    """Fields of all frequencies, far-field drift (frequencies, headings, 3), and seconds a frequency for the fields."""
    hull = hull_surface(body)
    shortest = 2.0 * np.pi * gravity / float(np.max(omegas)) ** 2
    surface = control_surface(hull, body.depth, shortest)
    found, far = [], []
    took = 0.0
    for omega in omegas:
        solution = solve(body, float(omega), headings, density, gravity)
        motion = response_amplitudes(solution, mass, stiffness) * (1.0 if free else 0.0)
        began = time.perf_counter()
        found.append(surface_fields(body, solution, motion, hull, surface))
        took += time.perf_counter() - began
        far.append(mean_drift(body, solution, motion))
    return found, np.array(far), took / len(omegas)


def diagonal(waves: list[SurfaceFields], form: str) -> FloatArray:
    """Mean drift (frequencies, headings, 6)."""
    return np.array([np.einsum("hhk->hk", quadratic_part(wave, wave, form).real) for wave in waves])


def compared(text: str, waves: list[SurfaceFields], far: FloatArray) -> list[Row]:
    """Both forms against the far field, and each other, in per cent of the largest over frequency and heading."""
    near = {form: diagonal(waves, form) for form in FORMS}
    rows = []
    for form, drift in near.items():
        for column, (name, axis) in enumerate(HORIZONTAL.items()):
            largest = np.max(np.abs(far[..., column]))
            if largest > 1e-6 * np.max(np.abs(far)):
                error = float(np.max(np.abs(drift[..., axis] - far[..., column])) / largest)
                rows.append(at_most(f"{text}: {name}, {form} against far field", 100.0 * error, LIMIT, "%"))
    for name, axis in VERTICAL.items():
        largest = np.max(np.abs(near["control"][..., axis]))
        if largest > 1e-2 * np.max(np.abs(near["control"][..., :3])):
            gap = float(np.max(np.abs(near["pressure"][..., axis] - near["control"][..., axis])) / largest)
            rows.append(Row(item=f"{text}: {name}, pressure against control surface", measured=f"{100.0 * gap:.2g} %"))
    return rows


def hemisphere_drift(quick: bool) -> list[Row]:
    mesh = hemisphere(1.0, 20, 13)
    body = discretize(mesh, lid=lid(mesh, 4))
    volume = 2.0 / 3.0 * np.pi
    mass = volume * np.diag([1.0, 1.0, 1.0, 0.4, 0.4, 0.4])
    stiffness = np.diag([0.0, 0.0, np.pi, 0.1, 0.1, 0.0])
    omegas = np.sqrt([0.5, 1.0, 1.5] if quick else [0.3, 0.5, 0.8, 1.0, 1.25, 1.5, 2.0])
    rows = []
    for free in (False, True):
        waves, far, _ = fields(body, omegas, np.zeros(1), mass, stiffness, 1.0, 1.0, free)
        text = f"{'floating' if free else 'fixed'} hemisphere, {mesh.panel_count} panels"
        rows += compared(text, waves, far)
    return rows


def tlp_drift(quick: bool) -> list[Row]:
    mesh = tlp(issc_hull(), 4.0 if quick else 2.4)
    body = discretize(mesh, DEPTH, lid(mesh, 2))
    omegas = 2.0 * np.pi / np.array([10.0, 15.0] if quick else [8.0, 10.0, 12.0, 15.0])
    rows = []
    for free in (False, True):
        waves, far, seconds = fields(body, omegas, np.radians([0.0, 22.5, 45.0]), *issc_mass(), 1.0, 9.80665, free)
        text = f"{'moving' if free else 'fixed'} ISSC TLP, {mesh.panel_count} panels"
        rows += compared(text, waves, far)
    places = len(waves[0].control.surface.places) + len(waves[0].control.surface.water) if waves[0].control else 0
    rows.append(Row(item=f"seconds a frequency for the field at {places} points", measured=f"{seconds:.3g} s"))
    return rows


def tlp_drift_extrapolated(quick: bool) -> list[Row]:
    """Pressure on the hull and far field, each extrapolated from this mesh and one of panels twice as large."""
    headings = np.radians([0.0, 22.5, 45.0])
    found: dict[bool, list[list[FloatArray]]] = {True: [], False: []}
    count = 0
    for coarse in (False, True):
        mesh = tlp(issc_hull(), 4.0 if quick else 2.4, coarse=coarse)
        body = discretize(mesh, DEPTH, lid(mesh, 2))
        count = count or mesh.panel_count
        for free, results in found.items():
            pressure, far = [], []
            for period in (10.0, 15.0) if quick else (8.0, 10.0, 12.0, 15.0):
                solution = solve(body, 2.0 * np.pi / period, headings, 1.0, 9.80665)
                still = np.zeros((len(headings), 6), dtype=np.complex128)
                motion = response_amplitudes(solution, *issc_mass()) if free else still
                pressure.append(near_field_drift(body, solution, motion, "pressure")[:, [0, 1, 5]])
                far.append(mean_drift(body, solution, motion))
            results.append([np.array(pressure), np.array(far)])
    rows = []
    for free, (fine, rough) in found.items():
        pressure, far = (limit(a, b).value for a, b in zip(fine, rough, strict=True))
        error = np.max(np.abs(pressure - far), axis=(0, 1)) / np.max(np.abs(far), axis=(0, 1))
        text = f"{'moving' if free else 'fixed'} ISSC TLP, {count} panels extrapolated"
        names = ("surge", "sway", "yaw")
        rows += [
            at_most(f"{text}: {name}, pressure against far field", 100.0 * float(value), 2.0, "%")
            for name, value in zip(names, error, strict=True)
        ]
    return rows


def cylinder_drift(quick: bool) -> list[Row]:
    """A deep fixed cylinder: the series for the mean drift, by the phases of MacCamy and Fuchs."""
    mesh = cylinder(1.0, 5.0, 10, 20, 5)
    body = discretize(mesh, lid=lid(mesh, 4))
    numbers = np.array([0.7, 1.0] if quick else [0.6, 0.8, 1.0, 1.25, 1.5])
    waves, _, _ = fields(body, np.sqrt(numbers), np.zeros(1), np.eye(6), np.diag(np.full(6, np.inf)), 1.0, 1.0, False)
    n = np.arange(25)[:, None]
    phase = np.arctan2(special.jvp(n, numbers), special.yvp(n, numbers))
    exact = np.sum(np.sin(phase[:-1] - phase[1:]) ** 2, axis=0) / numbers
    rows = []
    for form in FORMS:
        error = float(np.max(np.abs(diagonal(waves, form)[:, 0, 0] / exact - 1.0)))
        rows.append(at_most(f"deep cylinder, mean drift by {form} against series", 100.0 * error, LIMIT, "%"))
    return rows


def sharp_edges(quick: bool) -> list[Row]:
    """Heave drift of a fixed box: pressure, extrapolated by the first power of the panels, and control surface."""
    sizes = (0.125, 0.0625) if quick else (0.08, 0.04)
    held = np.diag(np.full(6, np.inf))
    heave = {form: np.empty(2) for form in FORMS}
    for row, panel in enumerate(sizes):
        mesh = box(2.0, 1.0, 0.5, panel)
        waves, _, _ = fields(discretize(mesh), np.array([1.2]), np.array([0.5]), np.eye(6), held, 1.0, 1.0, False)
        for form in FORMS:
            heave[form][row] = diagonal(waves, form)[0, 0, 2]
    final = heave["control"][1]
    limit = 2.0 * heave["pressure"][1] - heave["pressure"][0]
    return [
        at_most(
            "box, heave: control surface, change on halving panels",
            100.0 * abs(heave["control"][0] / final - 1.0),
            2.0,
            "%",
        ),
        Row(
            item="the same: pressure",
            measured=f"{100.0 * abs(heave['pressure'][0] / heave['pressure'][1] - 1.0):.2g} %",
        ),
        at_most(
            "the same: pressure, extrapolated, against control surface", 100.0 * abs(limit / final - 1.0), 3.0, "%"
        ),
    ]


def transfer_function(quick: bool) -> list[Row]:
    """Pairs of frequencies: symmetry, agreement of the forms, and what Newman's approximation leaves out."""
    mesh = hemisphere(1.0, 14 if quick else 20, 9 if quick else 13)
    body = discretize(mesh, lid=lid(mesh, 4))
    mass = 2.0 / 3.0 * np.pi * np.diag([1.0, 1.0, 1.0, 0.4, 0.4, 0.4])
    stiffness = np.diag([0.0, 0.0, np.pi, 0.1, 0.1, 0.0])
    waves, _, _ = fields(body, np.array([0.9, 1.0, 1.1]), np.zeros(1), mass, stiffness, 1.0, 1.0, True)
    full = {form: np.array([[quadratic_part(a, b, form)[0, 0] for b in waves] for a in waves]) for form in FORMS}
    surge = {form: matrix[..., 0] for form, matrix in full.items()}
    scale = float(np.max(np.abs(surge["control"])))
    rows = []
    for form, matrix in full.items():
        error = float(np.max(np.abs(matrix - np.swapaxes(matrix, 0, 1).conj())) / scale)
        rows.append(at_most(f"quadratic transfer function by {form}: T_ij less T_ji*", error, 1e-10))
    gap = float(np.max(np.abs(surge["pressure"] - surge["control"])) / scale)
    rows.append(at_most("the same, surge: pressure against control surface", 100.0 * gap, 3.0, "%"))
    mean = newman(np.diagonal(surge["control"]).real)
    left = float(np.max(np.abs(np.abs(surge["control"]) - np.abs(mean))) / scale)
    rows.append(Row(item="the same: modulus less Newman's, differences up to 0.2", measured=f"{100.0 * left:.2g} %"))
    return rows


def transfer_table(quick: bool) -> list[Row]:
    """What `tlpsim bem --qtf` makes of the moored ISSC TLP: its diagonal against the far field, both extrapolated."""
    fine, coarse = (tlp(issc_hull(), 8.0 if quick else 4.0, coarse=each) for each in (False, True))
    problem = Problem(
        mesh=fine,
        lid=lid(fine),
        coarse=coarse,
        coarse_lid=lid(coarse),
        omega=np.linspace(0.5, 1.2, 3 if quick else 8),
        heading=np.radians([21.6]),
        depth=DEPTH,
        mass=issc_problem().mass,
        stiffness=issc_problem().stiffness,
    )
    far = compute(problem).mean_drift
    began = time.perf_counter()
    table = quadratic_table(problem)
    took = (time.perf_counter() - began) / len(problem.omega)
    apart = np.abs(mean_drift_of(table)[..., list(HORIZONTAL.values())] - far)
    worst = float(np.max(apart / np.max(np.abs(far), axis=(0, 1))))
    return [
        at_most("quadratic transfer function of the moored TLP: diagonal against far field", 100.0 * worst, LIMIT, "%"),
        Row(item="the same, 0.5 to 1.2 rad/s, both meshes: seconds a frequency", measured=f"{took:.3g} s"),
    ]


def drift_damping(quick: bool) -> list[Row]:
    """Aranha's formula where the drift is known: the fully reflecting round wall, D = 2/3 ρ g a."""
    del quick
    omega, heading = np.linspace(0.5, 1.5, 21), np.linspace(0.0, 2.0 * np.pi, 37)
    along = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    found = wave_drift_damping(2.0 / 3.0 * np.broadcast_to(along, (21, 37, 2)), omega, heading, 1.0)
    along_waves = np.einsum("hi,fhij,hj->fh", along, found, along)
    error = float(np.max(np.abs(along_waves / (8.0 / 3.0 * omega[:, None]) - 1.0)))
    return [at_most("wave drift damping of a round wall in short waves", 100.0 * error, 0.1, "%")]


if __name__ == "__main__":
    main(
        "Second-order wave loads",
        [
            hemisphere_drift,
            tlp_drift,
            tlp_drift_extrapolated,
            cylinder_drift,
            sharp_edges,
            transfer_function,
            transfer_table,
            drift_damping,
        ],
    )
