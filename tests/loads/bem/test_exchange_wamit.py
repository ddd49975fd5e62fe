"""WAMIT's files and those that HAMS writes like them: round trips, rows worked out by hand, and moved origins."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tlpsim.loads.bem.database import HydrodynamicDatabase, Problem, compute
from tlpsim.loads.bem.discretization import discretize, rigid_modes
from tlpsim.loads.bem.exchange import read_hams, read_wamit, read_wamit_quadratic, write_wamit
from tlpsim.loads.bem.exchange.conventions import about_origin, told_time_sign
from tlpsim.loads.bem.hulls import box
from tlpsim.loads.bem.mesh import translated
from tlpsim.loads.bem.solver import solve
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.rigid_body import mass_matrix

MESH = translated(box(2.0, 1.0, 0.5, 0.5), [0.3, -0.2, 0.0])  # no symmetry: all of a matrix is filled
OMEGA, HEADING = np.array([0.5, 1.0, 2.0]), np.array([0.0, 0.4])
MASS = mass_matrix(1025.0, [0.0, 0.0, -0.1], np.diag([1e2, 3e2, 4e2]))
DATABASE = compute(Problem(mesh=MESH, omega=OMEGA, heading=HEADING, mass=MASS, stiffness=np.diag([1e4] * 6)))
ARRAYS = (
    "omega",
    "heading",
    "added_mass",
    "radiation_damping",
    "excitation_force",
    "froude_krylov_force",
    "added_mass_infinite",
    "added_mass_zero",
    "mean_drift",
    "response_amplitude",
)


def assert_close(again: HydrodynamicDatabase, expected: HydrodynamicDatabase, names: tuple[str, ...] = ARRAYS) -> None:
    """To the digits that the files have."""
    for name in names:
        value = getattr(expected, name)
        np.testing.assert_allclose(
            getattr(again, name), value, rtol=1e-6, atol=1e-7 * np.max(np.abs(value)), err_msg=name
        )


@pytest.mark.parametrize("length", [1.0, 7.5])
def test_files_give_the_database_back(tmp_path: Path, length: float) -> None:
    paths = write_wamit(DATABASE, tmp_path / "hull", length)
    assert {path.suffix for path in paths} == {".1", ".3", ".3fk", ".4", ".8", ".hst"}
    again = read_wamit(tmp_path / "hull", np.inf, length=length)
    assert_close(again, DATABASE)
    assert again.hydrostatics is not None
    assert DATABASE.hydrostatics is not None
    stiffness = DATABASE.hydrostatics.stiffness
    np.testing.assert_allclose(again.hydrostatics.stiffness, stiffness, atol=1e-7 * np.max(stiffness))
    assert again.hydrostatics.waterplane_area == pytest.approx(DATABASE.hydrostatics.waterplane_area)


def test_what_is_not_known_is_not_written(tmp_path: Path) -> None:
    unknown = np.full((6, 6), np.nan)
    bare = replace(
        DATABASE,
        froude_krylov_force=np.full_like(DATABASE.froude_krylov_force, np.nan),
        added_mass_zero=unknown,
        mean_drift=np.full_like(DATABASE.mean_drift, np.nan),
        response_amplitude=None,
        hydrostatics=None,
    )
    assert {path.suffix for path in write_wamit(bare, tmp_path / "hull")} == {".1", ".3"}
    again = read_wamit(tmp_path / "hull", np.inf)
    assert_close(again, DATABASE, ("added_mass", "excitation_force", "added_mass_infinite"))
    for name in ("froude_krylov_force", "added_mass_zero", "mean_drift"):
        assert np.all(np.isnan(getattr(again, name)))
    assert again.response_amplitude is None
    assert again.hydrostatics is None


def test_phase_is_the_lead_over_the_wave(tmp_path: Path) -> None:
    write_wamit(DATABASE, tmp_path / "hull")
    row = next(line.split() for line in (tmp_path / "hull.3").read_text().splitlines() if line.split()[2] == "3")
    force = DATABASE.excitation_force[0, 0, 2]
    assert float(row[4]) == pytest.approx(np.degrees(np.angle(force)), abs=1e-4)


def test_long_wave_tells_the_sign_of_the_phases() -> None:
    assert told_time_sign(HEADING, DATABASE.excitation_force) == 1
    assert told_time_sign(HEADING, DATABASE.excitation_force.conj()) == -1
    with pytest.raises(ScenarioError, match="time_sign"):
        told_time_sign(HEADING, np.zeros((2, 1, 6), dtype=np.complex128))


PERIOD = 2.0 * np.pi
BY_HAND = {
    ".1": f"""WAMIT numeric output: a heading line
 -1.0 3 3 0.5D+00
  0.0 3 3 0.25
 {PERIOD:.6E} 1 1 2.0E+00 1.0E-01
 {PERIOD:.6E} 1 5 3.0 0.2
 {PERIOD:.6E} 5 5 4.0 0.3
""",
    ".3": f"{PERIOD:.6E} 30.0 1 5.0 90.0 0.0 5.0\n{PERIOD:.6E} 30.0 4 2.0 180.0 -2.0 0.0\n",
    ".12d": f"""{PERIOD:.6E} {PERIOD:.6E} 30.0 30.0 3 7.0 180.0 -7.0 0.0
{PERIOD:.6E} {2 * PERIOD:.6E} 30.0 30.0 3 9.0 0.0 9.0 0.0
{PERIOD:.6E} {PERIOD:.6E} 30.0 60.0 3 9.0 0.0 9.0 0.0
{PERIOD:.6E} {PERIOD:.6E} 30.0 30.0 5 6.0 0.0 6.0 0.0
""",
    ".8": f"{PERIOD:.6E} 30.0 30.0 1 2.0 180.0 -2.0 0.0\n{PERIOD:.6E} 30.0 30.0 6 1.5 0.0 1.5 0.0\n",
    ".hst": "3 3 2.0\n3 5 -1.0\n5 3 -1.0\n4 4 6.0\n",
}


def written(folder: Path, *suffixes: str) -> Path:
    for suffix in suffixes:
        (folder / f"run{suffix}").write_text(BY_HAND[suffix])
    return folder / "run"


def test_dimensions_worked_out_by_hand(tmp_path: Path) -> None:
    """ω = 1 rad/s, ρ = 1000 kg/m³, g = 10 m/s², L = 2 m."""
    found = read_wamit(written(tmp_path, *BY_HAND), 50.0, 1000.0, 10.0, length=2.0)
    assert found.omega == pytest.approx([1.0], rel=1e-6)
    assert np.degrees(found.heading) == pytest.approx([30.0])
    assert found.added_mass[0, 0, 0] == pytest.approx(2.0 * 1000.0 * 2.0**3)
    assert found.added_mass[0, 0, 4] == pytest.approx(3.0 * 1000.0 * 2.0**4)
    assert found.radiation_damping[0, 4, 4] == pytest.approx(0.3 * 1000.0 * 2.0**5, rel=1e-6)
    assert found.added_mass_zero[2, 2] == pytest.approx(0.5 * 1000.0 * 2.0**3)
    assert found.added_mass_infinite[2, 2] == pytest.approx(0.25 * 1000.0 * 2.0**3)
    assert found.added_mass[0, 1, 1] == 0.0  # left out of a period that is there: zero by symmetry
    assert found.excitation_force[0, 0, 0] == pytest.approx(5j * 1000.0 * 10.0 * 2.0**2)
    assert found.excitation_force[0, 0, 3] == pytest.approx(-2.0 * 1000.0 * 10.0 * 2.0**3)
    # Surge, sway and yaw by momentum, the others from the diagonal of the QTF.
    drift = 1000.0 * 10.0 * np.array([-2.0 * 2.0, 0.0, -7.0 * 2.0, 0.0, 6.0 * 4.0, 1.5 * 4.0])
    np.testing.assert_allclose(found.mean_drift[0, 0], drift)
    assert found.hydrostatics is not None
    assert found.hydrostatics.waterplane_area == pytest.approx(2.0 * 4.0)
    assert found.hydrostatics.waterplane_first_moments == pytest.approx([8.0, 0.0])
    assert found.hydrostatics.stiffness[3, 3] == pytest.approx(6.0 * 1000.0 * 10.0 * 16.0)


def test_weight_is_taken_out_of_the_restoring(tmp_path: Path) -> None:
    stem = written(tmp_path, ".1", ".3", ".hst")
    found = read_wamit(stem, 50.0, 1000.0, 10.0, mass=500.0, centre_of_gravity=(0.0, 0.0, 3.0))
    assert found.hydrostatics is not None
    assert found.hydrostatics.stiffness[3, 3] == pytest.approx(6.0e4 + 500.0 * 10.0 * 3.0)
    # Without a mass, restoring moments about another point than the origin cannot be told.
    assert read_wamit(stem, 50.0, reference_point=(0.0, 0.0, -1.0)).hydrostatics is None


def test_moments_move_to_the_origin() -> None:
    """A solution for motions and moments about another point, against that about the origin."""
    point = np.array([1.5, -2.0, -0.7])
    body = discretize(MESH, modes=rigid_modes(MESH, point))
    there = solve(body, 1.0, HEADING)
    moved = about_origin(
        replace(
            DATABASE,
            omega=OMEGA[1:2],
            added_mass=there.added_mass[None],
            radiation_damping=there.radiation_damping[None],
            excitation_force=there.excitation_force[:, None],
            froude_krylov_force=there.froude_krylov_force[:, None],
            response_amplitude=None,
        ),
        point,
    )
    # The systems of equations are refined to 1e-11; the far arm of 2.5 m of a 1 m box costs two digits.
    for name, axis in (("added_mass", 0), ("radiation_damping", 0), ("excitation_force", 1)):
        expected = np.take(getattr(DATABASE, name), [1], axis=axis)
        np.testing.assert_allclose(
            getattr(moved, name), expected, atol=1e-8 * np.max(np.abs(expected)), err_msg=name, rtol=0.0
        )


def test_motion_moves_to_the_origin() -> None:
    """A point of a rigid body moves by the velocity of another one and by the rotation about it."""
    point, motion = np.array([1.5, -2.0, -0.7]), DATABASE.response_amplitude
    assert motion is not None
    there = motion.copy()
    there[..., :3] += np.cross(motion[..., 3:], point)
    moved = about_origin(replace(DATABASE, response_amplitude=there), point)
    assert moved.response_amplitude is not None
    np.testing.assert_allclose(moved.response_amplitude, motion, atol=1e-12 * np.max(np.abs(motion)))


PERIODS = (10.0, 8.0, 5.0)


def two_waves(folder: Path, rows: str, suffix: str = ".12d") -> Path:
    path = folder / f"run{suffix}"
    path.write_text(" PER1 PER2 BETA1 BETA2 I MOD PHA RE IM\n" + rows)
    return path


def both_orders(heading: float, *others: float) -> str:
    """Surge of all pairs of `PERIODS` at a heading (and of pairs with others): PER1 + i PER2 above the diagonal."""
    rows = ""
    for i, first in enumerate(PERIODS):
        for second in PERIODS[i:]:
            imaginary = 0.0 if first == second else second
            rows += f"{first} {second} {heading} {heading} 1 0.0 0.0 {first} {imaginary}\n"
        for other in others:
            rows += "".join(f"{first} {each} {heading} {other} 1 0.0 0.0 1.0 {first - each}\n" for each in PERIODS)
    return rows


@pytest.mark.parametrize("suffix", [".10d", ".11d", ".12d"])
def test_quadratic_transfer_worked_out_by_hand(tmp_path: Path, suffix: str) -> None:
    """ρ = 1000 kg/m³, g = 10 m/s², L = 2 m; the second order of the waves is that of the conjugate."""
    rows = both_orders(30.0) + "8.0 5.0 30.0 30.0 5 0.0 0.0 3.0 -4.0D+00\n"
    found = read_wamit_quadratic(two_waves(tmp_path, rows, suffix), 50.0, 1000.0, 10.0, length=2.0)
    np.testing.assert_allclose(found.omega, [0.2 * np.pi, 0.25 * np.pi, 0.4 * np.pi])
    np.testing.assert_allclose(found.heading, [np.pi / 6.0])
    force, moment = 1000.0 * 10.0 * 2.0, 1000.0 * 10.0 * 4.0
    surge = [[10.0, 10.0 + 8.0j, 10.0 + 5.0j], [10.0 - 8.0j, 8.0, 8.0 + 5.0j], [10.0 - 5.0j, 8.0 - 5.0j, 5.0]]
    np.testing.assert_allclose(found.transfer[0, ..., 0], force * np.array(surge))
    pitch = np.zeros((3, 3), dtype=np.complex128)  # left out of waves that are there: zero by symmetry
    pitch[1, 2], pitch[2, 1] = 3.0 - 4.0j, 3.0 + 4.0j
    np.testing.assert_allclose(found.transfer[0, ..., 4], moment * pitch)
    assert (found.depth, found.density, found.gravity) == (50.0, 1000.0, 10.0)
    assert f"run{suffix} of WAMIT" in found.contents


def test_quadratic_moments_move_to_the_origin(tmp_path: Path) -> None:
    """A push in surge at z = -3 m pitches about the origin by -3 m times it."""
    path = two_waves(tmp_path, both_orders(0.0))
    found = read_wamit_quadratic(path, reference_point=(0.0, 2.0, -3.0)).transfer
    np.testing.assert_allclose(found[..., 4], -3.0 * found[..., 0])
    np.testing.assert_allclose(found[..., 5], -2.0 * found[..., 0])


def test_pairs_of_headings_are_read_where_all_are_there(tmp_path: Path) -> None:
    alone = both_orders(0.0) + both_orders(90.0)
    assert read_wamit_quadratic(two_waves(tmp_path, alone)).transfer.shape == (2, 3, 3, 6)
    path = two_waves(tmp_path, both_orders(0.0, 90.0) + both_orders(90.0))
    found = read_wamit_quadratic(path, density=1.0, gravity=1.0).transfer
    assert found.shape == (2, 2, 3, 3, 6)
    assert found[0, 1, 0, 2, 0] == 1.0 + 5.0j  # 10 s at 0° with 5 s at 90°
    assert found[1, 0, 2, 0, 0] == 1.0 - 5.0j


def test_a_quadratic_transfer_that_is_not_whole_is_refused(tmp_path: Path) -> None:
    whole = both_orders(30.0).splitlines(keepends=True)
    gap = "".join(row for row in whole if not row.startswith("10.0 5.0"))
    for rows, message in (
        (gap, r"run\.12d: 2 pairs of waves .*first of 10 and 5 s at 30°; run the code for all pairs"),
        (whole[0].replace("10.0", "-1.0"), "wave period of -1 s"),
        (whole[0].replace(" 1 0.0", " 7 0.0"), "mode 7.*one body"),
        (whole[0], r"run\.12d: frequencies .* at least 2"),
        ("1 2 3\n", "at least 9 numbers"),
        ("".join(whole) + whole[1].replace("10.0 8.0", "8.0 10.0", 1), r"T_ij and T_ji\* differ in surge"),
    ):
        with pytest.raises(ScenarioError, match=message):
            read_wamit_quadratic(two_waves(tmp_path, rows))
    with pytest.raises(ScenarioError, match=r"none\.12d: cannot be read"):
        read_wamit_quadratic(tmp_path / "none.12d")


def hams_folder(folder: Path, column: int = 4, depth: str = "-1.D0") -> Path:
    (folder / "Input").mkdir()
    (folder / "Output" / "Wamit_format").mkdir(parents=True)
    (folder / "Input" / "ControlFile.in").write_text(
        f"  ---HAMS Control file---\n\n   Waterdepth  {depth}\n\n    Output_frequency_type  {column}\n"
        "    Reference_body_center   0.000   0.000   0.000\n    Reference_body_length   1.D0\n"
    )
    return folder / "Output" / "Wamit_format" / "Buoy"


@pytest.mark.parametrize("turned", [False, True], ids=["lead", "lag"])
def test_hams_is_read_whatever_its_sign(tmp_path: Path, turned: bool) -> None:
    other = DATABASE
    if turned:
        other = replace(DATABASE, excitation_force=DATABASE.excitation_force.conj(), response_amplitude=None)
    write_wamit(other, hams_folder(tmp_path))
    found = read_hams(tmp_path)
    assert np.isinf(found.depth)
    assert_close(found, DATABASE, ("omega", "added_mass", "radiation_damping", "excitation_force", "added_mass_zero"))


def test_hams_with_frequencies_in_its_first_column(tmp_path: Path) -> None:
    stem = hams_folder(tmp_path, column=3, depth="20.D0")
    write_wamit(DATABASE, stem)
    for suffix in (".1", ".3", ".3fk", ".4"):
        path = Path(f"{stem}{suffix}")
        rows = []
        for line in path.read_text().splitlines():
            first, rest = line.split(maxsplit=1)
            mark = {-1.0: 0.0, 0.0: -1.0}
            value = mark.get(float(first), 2.0 * np.pi / float(first) if float(first) > 0.0 else 0.0)
            rows.append(f"{value:.9E} {rest}")
        path.write_text("\n".join(rows))
    Path(f"{stem}.8").unlink()
    found = read_hams(tmp_path)
    assert found.depth == 20.0
    assert_close(found, DATABASE, ("omega", "added_mass", "excitation_force", "added_mass_zero", "added_mass_infinite"))


def test_files_that_cannot_be_read_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="stem"):
        read_wamit(tmp_path / "none", np.inf)
    with pytest.raises(ScenarioError, match="control file of HAMS"):
        read_hams(tmp_path)
    stem = written(tmp_path, ".1", ".3")
    Path(f"{stem}.3").write_text(BY_HAND[".3"] + "9.0 30.0 1 5.0 90.0 0.0 5.0\n")
    with pytest.raises(ScenarioError, match=r"period or frequency 9"):
        read_wamit(stem, np.inf)
    Path(f"{stem}.3").write_text(f"{PERIOD:.6E} 30.0 7 5.0 90.0 0.0 5.0\n")
    with pytest.raises(ScenarioError, match="one body"):
        read_wamit(stem, np.inf)
    Path(f"{stem}.3").write_text("1.0 2.0\n")
    with pytest.raises(ScenarioError, match="at least 7"):
        read_wamit(stem, np.inf)
    with pytest.raises(ScenarioError, match="cannot be written"):
        write_wamit(DATABASE, tmp_path / "no" / "folder")
    hams_folder(tmp_path, column=1)
    with pytest.raises(ScenarioError, match="Output_frequency_type is 1"):
        read_hams(tmp_path)
