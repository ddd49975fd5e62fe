"""Accuracy and speed of the boundary element code against closed solutions, published figures and Capytaine.

    .venv/bin/python benchmarks/bem.py [--quick]

Capytaine is a development dependency; its figures are taken in the same run on the same mesh.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from report import Row, at_least, at_most, main
from scipy import special

from tlpsim.loads.bem.convergence import Limit, limit, observed_limit
from tlpsim.loads.bem.database import Problem, compute
from tlpsim.loads.bem.discretization import Discretization, discretize, rigid_modes
from tlpsim.loads.bem.hemisphere import hemisphere_coefficients
from tlpsim.loads.bem.hulls import ISSC_VOLUME, cylinder, hemisphere, issc_hull, lid, tlp
from tlpsim.loads.bem.mesh import Mesh, merged, translated, whole
from tlpsim.loads.bem.response import energy_balance, far_field_damping, mean_drift, response_amplitudes
from tlpsim.loads.bem.solver import Solution, solve
from tlpsim.loads.bem.wamit_test07 import wamit_test07

FloatArray = NDArray[np.float64]

COLUMNS = ("A11", "A33", "A55", "A66", "B11", "B33", "B55", "B66", "surge", "sway", "yaw")
DEPTH = 450.0
TIGHT, WIDE = 0.5, 2.0
LIMITS = dict(zip(COLUMNS, (TIGHT,) * 5 + (WIDE,) * 3 + (TIGHT,) * 3, strict=True))
NAN = float("nan")
# OrcaWave on the WAMIT ISSC TLP test, 1012 panels a quadrant, 450 m, heading 35°; t, t m², per second, m/m, °/m.
PUBLISHED: dict[float, tuple[float, ...]] = {
    15.0: (49364.7, 28135.9, 5.82609e7, 1.173413e8, 1605.13, 46.895, 4.26679e5, 3478.7, 0.41662, 0.297903, 0.013155),
    12.0: (47305.5, 27899.6, 5.75433e7, 1.230517e8, NAN, NAN, NAN, NAN, 0.212027, 0.157162, 0.03906),
    11.0: (
        47835.4,
        27370.4,
        5.67444e7,
        1.275668e8,
        921.71,
        540.28,
        1.385916e6,
        6.27267e5,
        0.123777,
        0.093021,
        0.057028,
    ),
    10.0: (
        51518.9,
        27091.2,
        5.58411e7,
        1.356132e8,
        132.597,
        299.62,
        1.155643e6,
        2.7454697e6,
        0.032419,
        0.023308,
        0.082684,
    ),
}


def issc_mass() -> tuple[FloatArray, FloatArray]:
    """Mass (t) and stiffness of the published case: heave, roll and pitch held, no tethers."""
    mass = np.diag([ISSC_VOLUME] * 3 + [ISSC_VOLUME * (38.876**2 + 9.0)] * 2 + [ISSC_VOLUME * 42.420**2])
    mass[0, 4] = mass[4, 0] = 3.0 * ISSC_VOLUME
    mass[1, 3] = mass[3, 1] = -3.0 * ISSC_VOLUME
    return mass, np.diag([0.0, 0.0, np.inf, np.inf, np.inf, 0.0])


def hemisphere_accuracy(quick: bool) -> list[Row]:
    mesh = hemisphere(1.0, 20, 13)
    body = discretize(mesh, lid=lid(mesh, 4))
    volume = 2.0 / 3.0 * np.pi
    worst = {"A": 0.0, "B": 0.0}
    for number in (0.05, 0.5, 1.0, 2.0) if quick else np.linspace(0.05, 2.0, 14):
        solution = solve(body, float(np.sqrt(number)), [0.0], 1.0, 1.0)
        for mode, order in ((2, 0), (0, 1)):
            exact = hemisphere_coefficients(order, float(number))
            found = (solution.added_mass[mode, mode], solution.radiation_damping[mode, mode] / np.sqrt(number))
            for name, value, target in zip(worst, found, exact, strict=True):
                worst[name] = max(worst[name], abs(value / volume / target - 1.0))
    text = f"hemisphere, {mesh.panel_count} panels, 0.05 ≤ Ka ≤ 2"
    return [at_most(f"{text}, largest error of {name}", 100.0 * error, 0.3, "%") for name, error in worst.items()]


def issc_row(solution: Solution) -> FloatArray:
    modes = [0, 2, 4, 5]
    motion = np.abs(response_amplitudes(solution, *issc_mass())[0])
    return np.concatenate(
        [
            solution.added_mass[modes, modes],
            solution.radiation_damping[modes, modes],
            [motion[0], motion[1], np.degrees(motion[5])],
        ]
    )


def published_table(quick: bool) -> list[Row]:
    """The published table on the published panels, equations at the panels' centres as its code has them."""
    mesh = wamit_test07()
    body = discretize(mesh, DEPTH, collocation=True)
    rows = []
    for period, published in PUBLISHED.items():
        solution = solve(body, 2.0 * np.pi / period, [np.radians(35.0)], 1.0, 9.80665)
        for name, value, target in zip(COLUMNS, issc_row(solution), published, strict=True):
            if np.isfinite(target):
                error = 100.0 * (value / target - 1.0)
                ok = abs(error) <= LIMITS[name]
                text = f"published panels, {mesh.panel_count}, T = {period:g} s, {name}"
                rows.append(Row(item=text, measured=f"{error:+.2f} %", bound=f"± {LIMITS[name]:g} %", ok=ok))
    return rows


def issc_pair(panel: float, depth: float = DEPTH) -> tuple[Discretization, Discretization]:
    """The hull on a mesh and on one with panels twice as long."""
    meshes = (tlp(issc_hull(), panel, coarse=coarse) for coarse in (False, True))
    fine, coarse = (discretize(mesh, depth, lid(mesh, 2)) for mesh in meshes)
    return fine, coarse


def panel_count(body: Discretization) -> int:
    return body.hull_count * len(body.images)


def issc_limits(panel: float, periods: Sequence[float]) -> tuple[int, list[Limit]]:
    """Number of panels, and a row of the table extrapolated at each period."""
    fine, coarse = issc_pair(panel)
    rows = []
    for period in periods:
        values = [
            issc_row(solve(body, 2.0 * np.pi / period, [np.radians(35.0)], 1.0, 9.80665)) for body in (fine, coarse)
        ]
        rows.append(limit(*values))
    return panel_count(fine), rows


def converged(quick: bool) -> list[Row]:
    """The table on about 4000 panels, extrapolated, against twice as many, and what it says of the published one."""
    periods = (10.0,) if quick else tuple(PUBLISHED)
    count, ours = issc_limits(2.2, periods)
    finer, reference = issc_limits(1.7 if quick else 1.4, periods)
    rows = []
    for index, period in enumerate(periods):
        for column, name in enumerate(COLUMNS):
            value, exact = ours[index].value[column], reference[index].value[column]
            bar = ours[index].error[column] + reference[index].error[column]
            text = f"{count} panels extrapolated, T = {period:g} s, {name}, against {finer}"
            rows.append(
                Row(
                    item=text,
                    measured=f"{100.0 * (value / exact - 1.0):+.2f} %, bar {100.0 * bar / exact:.2f} %",
                    bound="inside the bar",
                    ok=bool(abs(value - exact) <= bar),
                )
            )
            published = PUBLISHED[period][column]
            if name in ("A11", "A33", "A55", "A66") and np.isfinite(published):
                text = f"published table, T = {period:g} s, {name}, against its limit"
                rows.append(Row(item=text, measured=f"{100.0 * (published / exact - 1.0):+.2f} %"))
    return rows


def consistency(quick: bool) -> list[Row]:
    """Relations of the exact solution, on about 4000 panels extrapolated."""
    fine, coarse = issc_pair(2.2)
    headings = np.radians([0.0, 22.5, 45.0])
    asymmetry, haskind, energy = 0.0, 0.0, 0.0
    dampings = []
    for period in (11.0, 10.0) if quick else (15.0, 12.0, 11.0, 10.0, 8.0):
        solutions = [solve(body, 2.0 * np.pi / period, headings, 1.0, 9.80665) for body in (fine, coarse)]
        mass, damping, force, other_force = (
            limit(*(getattr(solution, name) for solution in solutions)).value
            for name in ("added_mass", "radiation_damping", "excitation_force", "haskind_force")
        )
        far = limit(*(far_field_damping(body, s) for body, s in zip((fine, coarse), solutions, strict=True))).value
        dampings.append((damping.diagonal(), far.diagonal()))
        for matrix in (mass, damping):
            norm = np.sqrt(np.abs(np.outer(matrix.diagonal(), matrix.diagonal())))
            asymmetry = max(asymmetry, float(np.max(np.abs(matrix - matrix.T) / norm)))
        haskind = max(haskind, float(np.max(np.abs(other_force - force) / np.max(np.abs(force), axis=0))))
        energy = max(energy, float(np.abs(energy_balance(fine, solutions[0]) - 1.0).max()))
    near, away = np.moveaxis(np.array(dampings), 1, 0)
    # Where damping passes near zero it is measured by a tenth of its largest value.
    radiated = float(np.max(np.abs(away - near) / np.maximum(near, 0.1 * near.max(axis=0))))
    text = f"ISSC TLP, {panel_count(fine)} panels extrapolated,"
    return [
        at_most(f"{text} asymmetry of A and B", 100.0 * asymmetry, 0.1, "%"),
        at_most(f"{text} Haskind against pressure", 100.0 * haskind, 0.5, "%"),
        at_most(f"{text} damping against far field", 100.0 * radiated, 0.5, "%"),
        at_most("ISSC TLP, energy of the fixed body", 100.0 * energy, 0.5, "%"),
    ]


def accuracy_against_capytaine(quick: bool) -> list[Row]:
    """Added mass on one mesh of some 1600 panels in deep water, ours and both of Capytaine's methods, by the limit."""
    import capytaine

    logging.getLogger("capytaine").setLevel(logging.ERROR)
    omega = 2.0 * np.pi / 10.0
    modes = [0, 2, 4, 5]
    meshes = [tlp(issc_hull(), 3.6, coarse=coarse) for coarse in (False, True)]
    ours, twice = (solve(discretize(mesh), omega, [0.0], 1.0, 9.80665).added_mass[modes, modes] for mesh in meshes)
    pair = issc_pair(1.7, np.inf)
    exact = limit(*(solve(body, omega, [0.0], 1.0, 9.80665).added_mass[modes, modes] for body in pair)).value
    body = capytaine_body(meshes[0])
    problems = [
        capytaine.RadiationProblem(body=body, radiating_dof=dof, omega=omega, rho=1.0, g=9.80665)
        for dof in ("Surge", "Heave", "Pitch", "Yaw")
    ]
    values = {"ours": ours, "ours, extrapolated": limit(ours, twice).value}
    for method in ("direct", "indirect"):
        results = capytaine.BEMSolver(method=method).solve_all(problems, progress_bar=False)
        values[f"Capytaine, {method}"] = np.array([r.added_masses[r.radiating_dof] for r in results])
    worst = {name: float(np.max(np.abs(value / exact - 1.0))) for name, value in values.items()}
    text = f"{meshes[0].panel_count} panels, T = 10 s, deep, largest error of A11, A33, A55, A66"
    rows = [Row(item=f"{text}: {name}", measured=f"{100.0 * error:.2f} %") for name, error in worst.items()]
    theirs = min(error for name, error in worst.items() if name.startswith("Capytaine"))
    return [*rows, at_most(f"{text}: ours over Capytaine's better", worst["ours"] / theirs, 1.0)]


def maccamy_fuchs(quick: bool) -> list[Row]:
    draft, number = 8.0, 1.0
    mesh = cylinder(1.0, draft, 10, 24, 4)
    solution = solve(discretize(mesh, lid=lid(mesh, 3)), np.sqrt(number), [0.0], 1.0, 1.0)
    slope = 0.5 * (special.hankel2(0, number) - special.hankel2(2, number))
    exact = 4.0 / number**2 * (1.0 - np.exp(-number * draft)) / abs(slope)
    error = abs(abs(solution.excitation_force[0, 0]) / exact - 1.0)
    return [at_most("deep cylinder against MacCamy and Fuchs, ka = 1", 100.0 * float(error), 0.5, "%")]


def two_bodies(quick: bool) -> list[Row]:
    single = whole(hemisphere(1.0, 6, 4))
    count = len(single.vertices)
    pair = [translated(single, (x, 0.0, 0.0)) for x in (-2000.0, 2000.0)]
    modes = np.zeros((1, 2 * count, 12))
    modes[:, :count, :6] = rigid_modes(pair[0], (-2000.0, 0.0, 0.0))
    modes[:, count:, 6:] = rigid_modes(pair[1], (2000.0, 0.0, 0.0))
    both = solve(discretize(merged("pair", pair), modes=modes), 1.0, [0.0], 1.0, 1.0).added_mass
    alone = solve(discretize(single), 1.0, [0.0], 1.0, 1.0).added_mass
    error = max(float(np.max(np.abs(both[cut, cut] - alone))) for cut in (slice(0, 6), slice(6, 12)))
    return [at_most("two hemispheres 4000 radii apart against one, A", 100.0 * error / float(np.max(alone)), 0.1, "%")]


def richardson(quick: bool) -> list[Row]:
    """Extrapolation from three meshes of one family, with the observed order."""
    rows = []
    values = []
    for count in (4, 8, 16) if quick else (6, 12, 24):
        mesh = hemisphere(1.0, count, 3 * count // 4)
        solution = solve(discretize(mesh, lid=lid(mesh, 3)), 1.0, [0.0], 1.0, 1.0)
        values.append(solution.added_mass[[0, 2], [0, 2]] / (2.0 / 3.0 * np.pi))
    (value, bar), order = observed_limit(*values)
    for index, name in enumerate(("A11", "A33")):
        exact = hemisphere_coefficients(1 - index, 1.0)[0]
        rows.append(
            Row(
                item=f"hemisphere, Ka = 1, {name} extrapolated, order {order[index]:.2f}",
                measured=f"{value[index]:.5f} ± {bar[index]:.5f}",
                bound=f"holds {exact:.5f}",
                ok=bool(abs(value[index] - exact) <= bar[index]),
            )
        )
    return rows


def capytaine_body(mesh: Mesh) -> Any:
    import capytaine

    faces = mesh.vertices.reshape(-1, 3)
    hull: Any = capytaine.Mesh(vertices=faces, faces=np.arange(len(faces)).reshape(-1, 4))
    for plane, name in (("y", "xOz"), ("x", "yOz")):
        if plane in mesh.planes:
            hull = capytaine.ReflectionSymmetricMesh(hull, plane=name)
    return capytaine.FloatingBody(mesh=hull, dofs=capytaine.rigid_body_dofs(rotation_center=(0, 0, 0)))


def capytaine_seconds(mesh: Mesh, omegas: Sequence[float], depth: float) -> float:
    """Time of all six radiation problems and one diffraction problem a frequency, by its quicker method."""
    import capytaine

    logging.getLogger("capytaine").setLevel(logging.ERROR)
    body = capytaine_body(mesh)

    def problems(omega: float) -> list[Any]:
        shared = {"body": body, "omega": omega, "water_depth": depth, "rho": 1025.0, "g": 9.80665}
        radiation = [capytaine.RadiationProblem(radiating_dof=dof, **shared) for dof in body.dofs]
        return [*radiation, capytaine.DiffractionProblem(wave_direction=0.0, **shared)]

    def run(method: str) -> Callable[[], None]:
        solver = capytaine.BEMSolver(method=method)

        def work() -> None:
            for omega in omegas:
                solver.solve_all(problems(omega), progress_bar=False)

        solver.solve_all(problems(0.44)[:1], progress_bar=False)
        return work

    return min(seconds(run(method)) for method in ("direct", "indirect"))


def seconds(work: Callable[[], None]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def speed(quick: bool) -> list[Row]:
    quarter = tlp(issc_hull(), 4.3)
    omegas = [float(omega) for omega in np.linspace(0.2, 1.1, 4 if quick else 12)]
    rows = []
    for mesh, symmetry, bound in ((quarter, "two planes", 5.0), (whole(quarter), "no symmetry", 2.0)):
        for depth, water in ((np.inf, "deep"), (450.0, "450 m")):

            def work(mesh: Mesh = mesh, depth: float = depth) -> None:
                body = discretize(mesh, depth)
                for omega in omegas:
                    solve(body, omega, [0.0])

            solve(discretize(mesh, depth), 0.44, [0.0])  # compiles
            ours = min(seconds(work) for _ in range(2))
            theirs = capytaine_seconds(mesh, omegas, depth)
            text = f"{mesh.panel_count} panels, {len(omegas)} frequencies, {symmetry}, {water}"
            rows.append(Row(item=f"{text}: ours / Capytaine", measured=f"{ours:.2f} / {theirs:.2f} s"))
            rows.append(at_least(f"{text}: times quicker", theirs / ours, bound))
    return rows


def database_time(quick: bool) -> list[Row]:
    mesh, coarse = (tlp(issc_hull(), 4.0, coarse=coarse) for coarse in (False, True))
    count = 12 if quick else 60
    problem = Problem(
        mesh=mesh,
        omega=np.linspace(0.1, 1.2, count),
        heading=np.radians([0.0, 22.5, 45.0]),
        lid=lid(mesh, 2),
        coarse=coarse,
        coarse_lid=lid(coarse, 2),
        depth=450.0,
    )
    spent = seconds(lambda: compute(problem) and None)
    return [
        at_most(
            f"database, {mesh.panel_count} panels extrapolated, {count} frequencies, 450 m",
            spent,
            10.0 * count / 60.0,
            "s",
        )
    ]


def drift(quick: bool) -> list[Row]:
    mesh = tlp(issc_hull(), 4.0)
    body = discretize(mesh, lid=lid(mesh, 2))
    still = np.zeros((1, 6))
    solution = solve(body, 0.9, [0.4], 1.0, 9.80665)
    moved = translated(mesh, (20.0, -30.0, 0.0))
    other = discretize(moved, lid=whole_lid(mesh))
    second = mean_drift(other, solve(other, 0.9, [0.4], 1.0, 9.80665), still)[0]
    first = mean_drift(body, solution, still)[0]
    turned = first[2] + 20.0 * first[1] + 30.0 * first[0]
    error = abs(second[2] / turned - 1.0)
    return [at_most("far-field yaw drift about a moved origin", 100.0 * float(error), 0.1, "%")]


def whole_lid(mesh: Mesh) -> Mesh:
    return translated(lid(mesh, 2), (20.0, -30.0, 0.0))


if __name__ == "__main__":
    main(
        "Boundary element code",
        [
            hemisphere_accuracy,
            published_table,
            converged,
            consistency,
            accuracy_against_capytaine,
            maccamy_fuchs,
            two_bodies,
            drift,
            richardson,
            speed,
            database_time,
        ],
    )
