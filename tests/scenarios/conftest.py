"""A short scenario, a native FMU, a response of the frequency domain that needs no solver, a cluster of one thread."""

import importlib.util
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import dask
import numpy as np
import pytest
from distributed import Client, LocalCluster

from tlpsim.loads.constants import DEGREES_OF_FREEDOM
from tlpsim.loads.spectral.records import Mode, Quantity, SpectralResponse

MASTER_TESTS = Path(__file__).parents[1] / "orchestrator"

SHORT = """
title = "Short"
[simulation]
duration = 20.0
[waves]
components = 20
"""


@pytest.fixture
def scenario_file(tmp_path: Path) -> Path:
    """Scenario of 20 s."""
    path = tmp_path / "short.toml"
    path.write_text(SHORT)
    return path


@pytest.fixture
def hears_ctrl_c() -> Iterator[None]:
    """Ctrl-C is heard in the test, also where the tests are run by a shell that has it ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(scope="session")
def listening() -> Callable[[], None]:
    """The `preexec_fn` of a process that is to hear Ctrl-C, whatever the shell of the tests does."""

    def listen() -> None:
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    return listen


@pytest.fixture(scope="session")
def chain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The native test FMU of the master's tests: y' = k u - y, u in N, y in m."""
    spec = importlib.util.spec_from_file_location("chain_fmu", MASTER_TESTS / "native_fmu.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    if module.COMPILER is None:
        pytest.skip(module.NO_COMPILER)
    return Path(module.build(tmp_path_factory.mktemp("chain"), 2))


def lines(frequency: np.ndarray, slow: float, waves: float) -> np.ndarray:
    """Spectrum of a slow resonance at 0.01 Hz and of waves about 0.08 Hz, of the given standard deviations."""
    resonance = 1.0 / ((1.0 - (frequency / 0.01) ** 2) ** 2 + (0.4 * frequency / 0.01) ** 2)
    peak = np.exp(-0.5 * ((frequency - 0.08) / 0.01) ** 2)
    scaled = [std**2 * shape / np.trapezoid(shape, frequency) for std, shape in ((slow, resonance), (waves, peak))]
    return np.asarray(scaled[0] + scaled[1])


@pytest.fixture(scope="session")
def fake_response() -> Callable[..., SpectralResponse]:
    """Maker of a response that needs no solver; everything in it goes with the factors of slow and fast motion."""

    def make(slow: float = 1.0, waves: float = 1.0, skewness: float = 0.2) -> SpectralResponse:
        frequency = np.arange(1601) * 0.000625
        spreads = [(1.1, 0.7), (0.7, 0.3), (0.02, 0.015), (1e-4, 8e-5), (1e-4, 1e-4), (0.006, 0.003)]
        means = np.array([6.0, 5.0, -0.08, 2e-4, 3e-4, 0.02])
        table = {f"position.{n}": ("rad" if n in DEGREES_OF_FREEDOM[3:] else "m") for n in DEGREES_OF_FREEDOM}
        table |= {f"tendon_tension[{k}]": "N" for k in (1, 2)} | {f"tendon_bottom_tension[{k}]": "N" for k in (1, 2)}
        table |= {"point_acceleration[1].x": "m/s2"}
        means = [*means, 1.35e7, 1.3e7, 1.1e7, 1.0e7, 0.0]
        spreads += [(2e5, 8e5), (2e5, 7e5), (2e5, 8e5), (2e5, 7e5), (0.01, 0.3)]
        quantities = {
            name: Quantity(
                name=name,
                unit=unit,
                mean=float(mean) * slow,
                frequency=frequency,
                density=lines(frequency, slow * spread[0], waves * spread[1]),
                skewness=skewness,
                excess_kurtosis=2.0 * skewness**2,
            )
            for (name, unit), mean, spread in zip(table.items(), means, spreads, strict=True)
        }
        six = np.column_stack([each.density for each in list(quantities.values())[:6]])
        shares = {"wind": 0.5, "waves": 0.3, "slow drift": 0.2, "viscous": 0.1, "splash": 0.02, "all second order": 0.2}
        return SpectralResponse(
            frequency=frequency,
            quantities=quantities,
            cross_spectrum=six[:, :, None] * np.eye(6) * (1.0 + 0.0j),
            contributions={name: share * six for name, share in shares.items()},
            mean_loads={"wind": np.arange(6) * 1e6, "current": np.ones(6)},
            mean_position=np.array(means[:6]),
            modes=(
                Mode(name="surge", period=102.0, damping_ratio=0.2),
                Mode(name="heave", period=1.9, damping_ratio=0.02),
            ),
            iterations=(1.0, 1e-5),
            seconds={"loads": 0.1, "solution": 0.2},
        )

    return make


@pytest.fixture
def client(monkeypatch: pytest.MonkeyPatch) -> Iterator[Client]:
    """A cluster of one thread of this process in the place of processes."""
    from tlpsim.scenarios.sweep import execution

    with (
        dask.config.set({"distributed.admin.tick.limit": "1h"}),
        LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0") as cluster,
        Client(cluster) as made,
    ):

        @contextmanager
        def here(workers: int | None = None, scheduler: str | None = None) -> Iterator[Client]:
            yield made

        monkeypatch.setattr(execution, "connected", here)
        yield made
