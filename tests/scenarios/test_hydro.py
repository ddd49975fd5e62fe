"""`tlpsim bem` from the inside: texts of the command line, error bars, output formats, Ctrl-C, and the figures."""

import signal
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tlpsim.loads.bem.database import HydrodynamicDatabase, compute, read
from tlpsim.loads.bem.exchange import read_capytaine, read_wamit
from tlpsim.loads.bem.hulls import box
from tlpsim.loads.errors import ScenarioError
from tlpsim.scenarios.hull import Hull
from tlpsim.scenarios.hydro import (
    frequencies,
    make_problem,
    numbers,
    print_quadratic_transfer,
    quantity,
    require_quadratic,
    solved_quadratic,
    write_output,
)
from tlpsim.scenarios.hydro_figures import couplings, draw_hydrodynamics
from tlpsim.scenarios.progress import frequency_bar
from tlpsim.scenarios.quantities import DENSITY, LENGTH
from tlpsim.scenarios.terminal import output

MESH = box(20.0, 10.0, 5.0, 5.0)
HULL = Hull(mesh=MESH, lid=None, body=None, coarse=None)
TEXTS = ("0.4,0.8", "0,30", "inf", "1025", "9.80665")


def database(moving: bool = False) -> HydrodynamicDatabase:
    problem, _ = make_problem(HULL, *TEXTS, with_lid=False)
    if moving:
        problem = replace(problem, mass=1e6 * np.eye(6), stiffness=np.diag([1e5, 1e5, 2e6, 1e8, 1e8, 1e8]))
    return compute(problem)


DATABASE = database()


def test_numbers_are_ranges_or_lists() -> None:
    np.testing.assert_allclose(numbers("0.1:0.4:4", "--omega"), [0.1, 0.2, 0.3, 0.4])
    np.testing.assert_allclose(numbers("0, 22.5,45", "--headings"), [0.0, 22.5, 45.0])
    np.testing.assert_allclose(frequencies("0.8,0.2,0.8"), [0.2, 0.8])
    for text in ("", "a", "1:2", "1:2:0", "1:2:3:4", "1:2:1000000", "nan", "1,,2", "inf"):
        with pytest.raises(ScenarioError, match="START:STOP:COUNT"):
            numbers(text, "--omega")
    for text in ("0:1:3", "-1"):
        with pytest.raises(ScenarioError, match="above zero"):
            frequencies(text)


def test_quantities_take_units() -> None:
    assert quantity("0.45 km", "--depth", LENGTH) == 450.0
    assert quantity("inf", "--depth", LENGTH) == np.inf
    assert quantity("1.025 t/m3", "--rho", DENSITY) == pytest.approx(1025.0)
    for text, dimension in (("inf", DENSITY), ("0", LENGTH), ("-3", LENGTH), ("3 furlongs", LENGTH)):
        with pytest.raises(ScenarioError, match="--option"):
            quantity(text, "--option", dimension)


def test_problem_is_made_of_the_texts() -> None:
    problem, warnings = make_problem(HULL, "0.2:1.0:3", "0,90", "30", "1000", "9.81", with_lid=True)
    np.testing.assert_allclose(problem.omega, [0.2, 0.6, 1.0])
    np.testing.assert_allclose(problem.heading, [0.0, 0.5 * np.pi])
    assert (problem.depth, problem.density, problem.gravity, problem.mass) == (30.0, 1000.0, 9.81, None)
    assert warnings == []
    _, warnings = make_problem(HULL, "3.0", "0", "inf", "1000", "9.81", with_lid=False)
    assert len(warnings) == 2  # panels too large for a wave of 7 m, and irregular frequencies without a lid
    assert "panels below" in warnings[0]


@pytest.mark.parametrize("name", ["hull.h5", "hull.nc", "hull.1", "hull.data"])
def test_suffix_says_the_format(tmp_path: Path, name: str) -> None:
    paths = write_output(DATABASE, tmp_path / "new" / name)
    assert paths[0] == tmp_path / "new" / name
    readers = {".nc": lambda path: read_capytaine(path, np.inf)}
    readers[".1"] = lambda path: read_wamit(path.with_suffix(""), np.inf)
    again = readers.get(paths[0].suffix, read)(paths[0])
    np.testing.assert_allclose(again.added_mass, DATABASE.added_mass, rtol=1e-6, atol=1e-3)


def test_options_of_a_quadratic_transfer_function(tmp_path: Path) -> None:
    base, qtf = tmp_path / "hydro.h5", tmp_path / "qtf.h5"
    require_quadratic(None, base, "0.5", None, False)
    require_quadratic(qtf, base, "0.5", "0.3:1:4", True)
    for arguments, message in (
        ((None, base, "0.5", "0.3:1:4", False), "--qtf-omega and --qtf-pairs are for --qtf"),
        ((None, base, "0.5", None, True), "--qtf-omega and --qtf-pairs are for --qtf"),
        ((base, base, "0.3:1:4", None, False), r"both .*hydro\.h5; give two names"),
        ((tmp_path, base, "0.3:1:4", None, False), "is a folder"),
        ((qtf, base, "0.5", None, False), "at least 2"),
        ((qtf, base, "0.3:1:4", "1", False), "at least 2"),
        ((qtf, base, "0.3:1:4", "0:1:4", False), "--qtf-omega has 0 rad/s"),
    ):
        with pytest.raises(ScenarioError, match=message):
            require_quadratic(*arguments)


def test_quadratic_transfer_function_of_a_problem() -> None:
    problem, _ = make_problem(HULL, "0.2:1.0:3", "0,90", "30", "1000", "9.81", with_lid=False)
    table = solved_quadratic(problem, "0.4,0.6", True)
    np.testing.assert_array_equal(table.omega, [0.4, 0.6])
    assert table.transfer.shape == (2, 2, 2, 2, 6)
    with output.capture() as told:
        print_quadratic_transfer(table)
        print_quadratic_transfer(replace(table, depth=np.nan, gravity=np.nan))
    for words in ("depth 30 m, 1000 kg/m³", "0.4, 0.6 rad/s", "0, 90°; all pairs of headings", "second order is left"):
        assert words in " ".join(told.get().split())
    assert "off the database" not in told.get()
    assert "depth – m" in told.get()


def hidden_in_compiled_code() -> None:
    with frequency_bar():
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt as error:
            raise SystemError("returned a result with an exception set") from error


def lost_in_a_callback() -> None:
    with frequency_bar() as tell:
        with suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        tell(1, 2)


@pytest.mark.parametrize("interrupted", [hidden_in_compiled_code, lost_in_a_callback])
def test_ctrl_c_ends_a_computation(interrupted: Callable[[], None], hears_ctrl_c: None) -> None:
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert signal.getsignal(signal.SIGINT) is before


def test_other_errors_pass_the_progress_bar() -> None:
    with pytest.raises(ValueError, match="of the block"), frequency_bar():
        raise ValueError("of the block")


PNG = b"\x89PNG"
ALWAYS = ["added_mass.png", "radiation_damping.png", "excitation_force.png"]


def test_all_of_a_database_is_drawn(tmp_path: Path) -> None:
    paths = draw_hydrodynamics(tmp_path / "new", database(moving=True))
    assert [path.name for path in paths] == [*ALWAYS, "mean_drift.png", "response_amplitude.png", "mesh.png"]
    for path in paths:
        assert path.read_bytes().startswith(PNG)


def test_what_is_not_known_is_not_drawn(tmp_path: Path) -> None:
    bare = replace(
        DATABASE,
        mesh=None,
        mean_drift=np.full((2, 2, 3), np.nan),
        froude_krylov_force=np.full((2, 2, 6), np.nan * 1j),
        added_mass_zero=np.full((6, 6), np.nan),
    )
    assert [path.name for path in draw_hydrodynamics(tmp_path, bare)] == ALWAYS


def test_drift_of_six_components_is_drawn(tmp_path: Path) -> None:
    six = replace(DATABASE, mean_drift=np.ones((2, 2, 6)))
    assert "mean_drift.png" in [path.name for path in draw_hydrodynamics(tmp_path, six)]


def test_main_couplings_are_chosen() -> None:
    matrices = np.tile(np.diag([1.0, 1.0, 1.0, 100.0, 100.0, 100.0]), (2, 1, 1))
    matrices[1, 0, 4] = matrices[1, 4, 0] = -3.0
    matrices[0, 2, 4] = matrices[0, 4, 2] = 4.0
    matrices[0, 1, 2] = matrices[0, 2, 1] = 0.1
    assert couplings(matrices) == [(0, 4), (2, 4)]


def test_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ScenarioError, match="another folder"):
        draw_hydrodynamics(tmp_path / "file", DATABASE)
