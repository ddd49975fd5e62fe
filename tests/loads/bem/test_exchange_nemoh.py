"""NEMOH's result folders, made here in the layout of its versions 2 and 3."""

from pathlib import Path

import numpy as np
import pytest

from tlpsim.loads.bem.database import Problem, compute
from tlpsim.loads.bem.exchange import read_nemoh_results
from tlpsim.loads.bem.exchange.conventions import moments_arm
from tlpsim.loads.bem.hulls import box
from tlpsim.loads.bem.mesh import translated
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.waves.airy import wavenumber

MESH = translated(box(2.0, 1.0, 0.5, 0.5), [0.3, -0.2, 0.0])
DATABASE = compute(
    Problem(mesh=MESH, omega=np.array([0.5, 1.0]), heading=np.radians([0.0, 30.0]), depth=8.0, gravity=9.81)
)
FIRST_COLUMN = {"w (rad/s)": lambda w: w, "f (Hz)": lambda w: w / 2.0 / np.pi, "T (s)": lambda w: 2.0 * np.pi / w}


def folder(
    path: Path, unit: str = "w (rad/s)", point: str = "0. 0. 0.", crest: str = "0. 0.", depth: str = "8."
) -> Path:
    results = path / "Results"
    results.mkdir(parents=True)
    rotations = [f"2 {axis} {point}" for axis in ("1. 0. 0.", "0. 1. 0.", "0. 0. 1.")]
    translations = ["1 1. 0. 0. 0. 0. 0.", "1 0. 1. 0. 0. 0. 0.", "1 0. 0. 1. 0. 0. 0."]
    lines = ["--- Environment ---", "1025. ! RHO", "9.81 ! G", f"{depth} ! DEPTH", f"{crest} ! XEFF YEFF"]
    lines += ["--- Bodies ---", "1", "--- Body 1 ---", "box.dat", "10 10", "6", *translations, *rotations]
    (path / "Nemoh.cal").write_text("\n".join(lines) + "\n")
    column = [FIRST_COLUMN[unit](omega) for omega in DATABASE.omega]
    rows = [f'VARIABLES="{unit}"', *['"A" "B"'] * 6]
    for motion in range(6):
        rows.append(f'Zone t="Motion of body    1 in DoF   {motion + 1}",I=     2,F=POINT')
        for index, value in enumerate(column):
            pairs = zip(
                DATABASE.added_mass[index, :, motion], DATABASE.radiation_damping[index, :, motion], strict=True
            )
            rows.append(f" {value:.9E} " + " ".join(f"{a:.9E} {b:.9E}" for a, b in pairs))
    (results / "RadiationCoefficients.tec").write_text("\n".join(rows) + "\n")
    for name, title, force in (
        ("ExcitationForce.tec", "Excitation force", DATABASE.excitation_force),
        ("FKForce.tec", "FKforce", DATABASE.froude_krylov_force),
    ):
        rows = [f'VARIABLES="{unit}"', *['"abs(F)" "angle(F)"'] * 6]
        for place, heading in enumerate(np.degrees(DATABASE.heading)):
            rows.append(f'Zone t="{title} - beta = {heading:7.3f} deg",I=     2,F=POINT')
            for index, value in enumerate(column):
                there = force[place, index].conj()  # exp(-i omega t)
                rows.append(f" {value:.9E} " + " ".join(f"{abs(x):.9E} {np.angle(x):.9E}" for x in there))
        (results / name).write_text("\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize("unit", FIRST_COLUMN)
def test_results_are_read(tmp_path: Path, unit: str) -> None:
    found = read_nemoh_results(folder(tmp_path / "run", unit))
    assert (found.density, found.gravity, found.depth) == (1025.0, 9.81, 8.0)
    for name in (
        "omega",
        "heading",
        "added_mass",
        "radiation_damping",
        "excitation_force",
        "froude_krylov_force",
    ):
        expected = getattr(DATABASE, name)
        np.testing.assert_allclose(
            getattr(found, name), expected, rtol=1e-7, atol=1e-8 * np.max(np.abs(expected)), err_msg=name
        )
    assert np.all(np.isnan(found.added_mass_infinite))


def test_depth_zero_is_deep_water_and_small_letters_are_taken(tmp_path: Path) -> None:
    run = folder(tmp_path / "run", depth="0.")
    (run / "Results").rename(run / "results")
    assert np.isinf(read_nemoh_results(run).depth)


def test_crest_elsewhere_is_moved_to_the_origin(tmp_path: Path) -> None:
    """A wave whose crest is at x = 3 m at t = 0 is, at the origin, ahead by k x for a heading of 0."""
    found = read_nemoh_results(folder(tmp_path / "run", crest="3. 0."))
    number = float(wavenumber(1.0, 8.0, 9.81))
    ratio = found.excitation_force[0, 1, 2] / DATABASE.excitation_force[0, 1, 2]
    # η = cos(ω t - k (x - 3)): its force is that of cos(ω t - k x) times exp(3 i k), which is taken off.
    assert ratio == pytest.approx(np.exp(-3j * number), rel=1e-7)


def test_rotations_about_another_point_are_moved(tmp_path: Path) -> None:
    found = read_nemoh_results(folder(tmp_path / "run", point="0. 0. -5."))
    turn = moments_arm([0.0, 0.0, -5.0])
    expected = turn @ DATABASE.added_mass @ turn.T
    np.testing.assert_allclose(found.added_mass, expected, rtol=1e-6, atol=1e-7 * np.max(np.abs(expected)))


def test_folders_that_cannot_be_read_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=r"Nemoh\.cal"):
        read_nemoh_results(tmp_path / "none")
    run = folder(tmp_path / "run")
    path = run / "Results" / "ExcitationForce.tec"
    path.write_text(path.read_text().replace("beta", "gamma"))
    with pytest.raises(ScenarioError, match="beta"):
        read_nemoh_results(run)
    path.unlink()
    with pytest.raises(ScenarioError, match="no such file"):
        read_nemoh_results(run)
    radiation = run / "Results" / "RadiationCoefficients.tec"
    radiation.write_text("".join(radiation.read_text().partition('Zone t="Motion of body    1 in DoF   6"')[:1]))
    with pytest.raises(ScenarioError, match="5 motions"):
        read_nemoh_results(run)
    cal = run / "Nemoh.cal"
    cal.write_text(cal.read_text().replace("2 1. 0. 0. 0. 0. 0.", "2 1. 0. 0. 0. 0. 9."))
    with pytest.raises(ScenarioError, match="2 points"):
        read_nemoh_results(run)
