"""Quadratic transfer functions in their file: round trips, and what is wrong with a file told with its remedy."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from tlpsim.loads.bem.database import is_database
from tlpsim.loads.bem.quadratic_transfer import (
    QuadraticTransfer,
    adjoint,
    is_quadratic_transfer,
    largest_values,
    mean_drift_of,
    of_one_heading,
    quadratic_transfer_by_name,
    read_quadratic_transfer,
    write_quadratic_transfer,
)
from tlpsim.loads.errors import ScenarioError

OMEGA, HEADING = np.array([0.4, 0.6, 1.0]), np.array([0.0, 0.5])


def table(pairs: bool) -> QuadraticTransfer:
    rng = np.random.default_rng(1)
    shape = (2, 2, 3, 3, 6) if pairs else (2, 3, 3, 6)
    values = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
    return QuadraticTransfer(
        omega=OMEGA,
        heading=HEADING,
        transfer=values + adjoint(values),
        depth=450.0,
        density=1025.0,
        gravity=9.81,
        contents="quadratic part; fixed body",
    )


@pytest.mark.parametrize("pairs", [False, True])
def test_a_file_gives_the_record_back(tmp_path: Path, pairs: bool) -> None:
    wanted = table(pairs)
    path = tmp_path / "new" / "qtf.h5"
    write_quadratic_transfer(wanted, path)
    assert [each.name for each in path.parent.iterdir()] == ["qtf.h5"]
    found = quadratic_transfer_by_name(str(path), 1000.0, 9.8)
    for name in ("omega", "heading", "transfer"):
        np.testing.assert_array_equal(getattr(found, name), getattr(wanted, name))
    for name in ("depth", "density", "gravity", "contents"):
        assert getattr(found, name) == getattr(wanted, name)
    assert is_quadratic_transfer(path)
    assert not is_database(path)
    with h5py.File(path) as file:
        assert file.attrs["time_factor"] == "exp(+i omega t)"
        assert file["transfer"].attrs["unit"] == "N/m2, N/m"
        assert file["transfer"].attrs["dimensions"].count("heading") == (2 if pairs else 1)


def test_unknown_water_stays_unknown(tmp_path: Path) -> None:
    bare = replace(table(False), depth=np.nan, density=np.nan, gravity=np.nan, contents="")
    write_quadratic_transfer(bare, tmp_path / "qtf.h5")
    found = read_quadratic_transfer(tmp_path / "qtf.h5")
    assert np.isnan([found.depth, found.density, found.gravity]).all()


def test_parts_of_a_table() -> None:
    whole = table(True)
    np.testing.assert_array_equal(of_one_heading(whole)[1], whole.transfer[1, 1])
    np.testing.assert_array_equal(mean_drift_of(whole)[1, 2], whole.transfer[1, 1, 2, 2].real)
    assert largest_values(whole)[3] == np.max(np.abs(whole.transfer[..., 3]))


def test_a_table_that_is_none_is_refused() -> None:
    good = table(False)
    for changes, message in (
        ({"heading": np.zeros(3)}, r"shape \(2, 3, 3, 6\); 3 headings and 3 frequencies need"),
        ({"omega": OMEGA[::-1]}, "positive and ascending"),
        ({"omega": OMEGA - 0.4}, "positive and ascending"),
        ({"heading": np.array([0.0, np.nan])}, "not finite"),
        ({"transfer": good.transfer * np.nan}, "not finite"),
        ({"transfer": good.transfer * 1j}, r"T_ij and T_ji\* differ in surge by .*first index not conjugated"),
    ):
        with pytest.raises(ScenarioError, match=message):
            replace(good, **changes)  # type: ignore[arg-type]


def _attribute(name: str, value: object) -> Callable[[h5py.File], None]:
    return lambda file: file.attrs.__setitem__(name, value)


def _values(file: h5py.File) -> None:
    file["transfer"][0, 0, 1, 2] += 100.0


DAMAGES: dict[str, tuple[Callable[[h5py.File], None], str]] = {
    "kind": (_attribute("schema", "other 1"), r"schema is 'other 1', .*; make it with `tlpsim bem HULL .* --qtf"),
    "newer": (_attribute("schema", "tlpsim quadratic transfer function 9"), "newer tlpsim: install"),
    "phases": (_attribute("time_factor", "exp(-i omega t)"), r"time_factor is 'exp\(-i omega t\)'.* convert"),
    "dataset": (lambda file: file.__delitem__("transfer"), "damaged .*transfer.* make it with"),
    "attribute": (lambda file: file.attrs.__delitem__("depth"), "damaged .*depth.* make it with"),
    "units": (lambda file: file["transfer"].attrs.__setitem__("unit", "kN/m2"), "unit of transfer is 'kN/m2'"),
    "values": (_values, r"T_ij and T_ji\* differ in heave"),
}


@pytest.mark.parametrize("case", DAMAGES)
def test_a_damaged_file_is_told(tmp_path: Path, case: str) -> None:
    path = tmp_path / "qtf.h5"
    write_quadratic_transfer(table(False), path)
    damage, message = DAMAGES[case]
    with h5py.File(path, "r+") as file:
        damage(file)
    with pytest.raises(ScenarioError, match=rf"qtf\.h5: .*{message}") as caught:
        read_quadratic_transfer(path)
    assert "\n" not in str(caught.value)


def test_files_that_are_none_are_told(tmp_path: Path) -> None:
    cut = tmp_path / "cut.h5"
    write_quadratic_transfer(table(False), cut)
    cut.write_bytes(cut.read_bytes()[:3000])
    for path in (cut, tmp_path / "none.h5"):
        with pytest.raises(ScenarioError, match=rf"{path.name}: not a quadratic transfer function, or damaged"):
            read_quadratic_transfer(path)
        assert not is_quadratic_transfer(path)
    with pytest.raises(ScenarioError, match=r"qtf\.csv: .*\.h5 file, or \.10d, \.11d, \.12d of WAMIT, not '\.csv'"):
        quadratic_transfer_by_name("qtf.csv", 1025.0, 9.81)
    with pytest.raises(ScenarioError, match="cannot be written"):
        write_quadratic_transfer(table(False), cut / "qtf.h5")
