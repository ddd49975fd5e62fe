"""The wave FMU: first-order diffraction force, and drag of waves and current on the hull's members.

The sea comes from digital filters (`generator` "arma") or is a sum of harmonic components ("harmonic"). The
first-order force is that of a hydrodynamic database, or Morison's inertia force on the members.
"""

import ctypes

# pythonfmu 0.7 gives back, at every instantiation, a reference to this module's globals that it never took.
ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))

from pathlib import Path  # noqa: E402

from tlpsim.fmus.version import built_version  # noqa: E402

built_version(Path(__file__).parent)  # before the imports that another version may not have

from typing import Any  # noqa: E402

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from tlpsim.fmus.component import (  # noqa: E402
    Component,
    Variable,
    boolean_parameter,
    integer_parameter,
    real_parameter,
    six,
    text_parameter,
)
from tlpsim.fmus.current import CURRENT_PARAMETERS  # noqa: E402
from tlpsim.fmus.force_rate import RATE_STEP, Motion, force_rates  # noqa: E402
from tlpsim.fmus.hull import HULL_PARAMETER  # noqa: E402
from tlpsim.fmus.wave_parameters import wave_model  # noqa: E402
from tlpsim.loads.constants import SEA_WATER_DENSITY, STANDARD_GRAVITY  # noqa: E402
from tlpsim.loads.filters.process import ProcessState  # noqa: E402
from tlpsim.loads.issc_tlp import DRAG_COEFFICIENT  # noqa: E402
from tlpsim.loads.waves.elevation import DEFAULT_ORDERS, DEFAULT_SAMPLING_STEP, ArmaSea  # noqa: E402

_FORCE = ("N", "N.m")
_MOTION = ("position.*", "velocity.*")


class TlpsimWave(Component):
    """Adapter over `tlpsim.loads.waves` and `tlpsim.loads.hydro`."""

    description = "Wave and current forces on a moving platform: diffraction and relative-velocity drag"
    table = (
        *six("position", "input", "position of the platform", ("m", "rad")),
        *six("velocity", "input", "velocity of the platform", ("m/s", "rad/s")),
        *six("force", "output", "sum of the parts", _FORCE, depends_on=_MOTION),
        *force_rates(_MOTION),
        *six("diffraction", "output", "first-order wave force", _FORCE, depends_on=("position.*",)),
        *six("viscous", "output", "drag of waves and current", _FORCE, depends_on=_MOTION),
        *six("drift", "output", "slow drift of second order", _FORCE, depends_on=("position.*",)),
        *six("drift_damping", "output", "wave drift damping", _FORCE, depends_on=("velocity.*",)),
        Variable(
            name="elevation",
            causality="output",
            unit="m",
            description="undisturbed wave elevation at the platform's reference point",
            depends_on=("position.*",),
        ),
        real_parameter("significant_height", "m", 7.0, "Hs; zero is calm water, whatever the spectrum"),
        real_parameter("peak_period", "s", 14.0, "Tp"),
        real_parameter("peak_enhancement", "1", 3.3, "gamma of the JONSWAP spectrum"),
        real_parameter("heading", "rad", 0.0, "mean direction toward which the waves travel"),
        real_parameter("spreading_exponent", "1", 10.0, "s of the cos-2s spreading; no effect with one direction"),
        real_parameter("frequency_min", "Hz", 0.02, "lowest wave frequency of the generator harmonic"),
        real_parameter("frequency_max", "Hz", 0.35, "highest wave frequency"),
        real_parameter(
            "sampling_step",
            "s",
            DEFAULT_SAMPLING_STEP,
            "time between samples of the elevation of the generator arma; the realization does not depend on the "
            "macro step",
        ),
        real_parameter("water_depth", "m", 450.0, "depth of the water"),
        real_parameter("water_density", "kg/m3", SEA_WATER_DENSITY, "density of the water"),
        real_parameter("gravity", "m/s2", STANDARD_GRAVITY, "acceleration of gravity"),
        *CURRENT_PARAMETERS,
        real_parameter("drag_coefficient", "1", DRAG_COEFFICIENT, "of the ISSC TLP's columns and pontoons"),
        integer_parameter("directions", 1, "number of long-crested seas that make up the sea; 1 is long-crested"),
        integer_parameter("components", 400, "number of components a direction, of the generator harmonic"),
        integer_parameter("orders.long", DEFAULT_ORDERS.long, "order of the long autoregression"),
        integer_parameter("orders.autoregressive", DEFAULT_ORDERS.autoregressive, "p of the ARMA(p, q) elevation"),
        integer_parameter("orders.moving_average", DEFAULT_ORDERS.moving_average, "q of the ARMA(p, q) elevation"),
        integer_parameter("seed", 1, "realization"),
        boolean_parameter("displaced_position", True, "take the waves at the platform's displaced position"),
        text_parameter(
            "spectrum", "jonswap", "wave spectrum: jonswap, pierson_moskowitz or torsethaugen (wind sea and swell)"
        ),
        text_parameter(
            "spectrum_table",
            "",
            "JSON object of columns frequency (Hz) and density (m2/Hz) instead of the spectrum, its height "
            "and its period; empty: none",
        ),
        text_parameter(
            "generator", "arma", "how the sea is made: arma (digital filters) or harmonic (sum of components)"
        ),
        text_parameter(
            "hydrodynamics",
            "",
            "first-order force: path of a hydrodynamic database (.h5); morison: inertia of the members; empty: the "
            "database of the ISSC TLP, or of `hull`, for this water, computed on first use",
        ),
        HULL_PARAMETER,
        boolean_parameter("splash", True, "drag up to the surface of the waves, not to mean water level"),
        text_parameter("stretching", "vertical", "of velocities to that surface: vertical, wheeler, linear or none"),
        text_parameter(
            "drift",
            "newman",
            "slow drift: newman (Newman's approximation, arithmetic), newman_geometric, qtf (from a file) or none",
        ),
        text_parameter(
            "quadratic_transfer",
            "",
            "path of a quadratic transfer function (.h5), or of WAMIT's .10d, .11d or .12d with ULEN 1 m about the "
            "origin, for drift qtf; empty: none",
        ),
        boolean_parameter("drift_damping", True, "wave drift damping by Aranha's formula, beside slow drift"),
        boolean_parameter("doppler", False, "the waves ride on the current"),
        text_parameter(
            "members",
            "",
            "JSON object of the columns of the members' table (start, end, across, width, area, "
            "drag_coefficient, added_mass_coefficient, end_pressure, end_added_mass_coefficient); empty: those of the "
            "ISSC TLP, with the parameters drag_coefficient and hull",
        ),
    )

    def prepare(self) -> None:
        """Draw the sea and take views of the variables."""
        self.model = wave_model(self.parameter)
        self.position = self.view("position.")
        self.velocity = self.view("velocity.")
        self.force = self.view("force.")
        self.force_rate = self.view("force_rate.")
        self.motion = Motion()
        self.diffraction = self.view("diffraction.")
        self.viscous = self.view("viscous.")
        self.drift = self.view("drift.")
        self.drift_damping = self.view("drift_damping.")
        self.elevation = self.view("elevation")

    def retune(self) -> None:
        """Take another current, in which the same waves travel on.

        Raises
        ------
        ScenarioError
            When the waves ride on the current.
        """
        self.model = wave_model(self.parameter, self.model.sea)

    def start(self, time: float) -> None:
        """Forces and elevation at `time`."""
        self.motion.begin(self.velocity)
        self._update(time)

    def _update(self, time: float) -> None:
        forces = self.model.evaluate(time, self.position, self.velocity)
        self.diffraction[:] = forces.diffraction
        self.viscous[:] = forces.viscous
        self.drift[:] = forces.drift
        self.drift_damping[:] = forces.drift_damping
        self.force[:] = forces.total
        self.elevation[0] = forces.elevation
        h = RATE_STEP
        after = self.position + h * self.velocity, self.velocity + h * self.motion.acceleration
        self.force_rate[:] = (self.model.evaluate(time + h, *after).total - self.force) / h

    def advance(self, time: float, step: float) -> None:
        """Forces and elevation at the end of the step."""
        self.motion.advance(self.velocity, step)
        self._update(time + step)

    def snapshot(self) -> dict[str, NDArray[Any]]:
        """Windows of samples and noises of the filters, one process a direction, and the motion."""
        arrays: dict[str, NDArray[Any]] = dict(self.motion.snapshot())
        if not isinstance(self.model.sea, ArmaSea):
            return arrays
        for j, state in enumerate(self.model.sea.get_state()):
            arrays[f"index.{j}"] = np.array(state.index)
            arrays[f"samples.{j}"] = np.array(state.samples)
            arrays[f"noises.{j}"] = np.array(state.noises)
        return arrays

    def restore(self, arrays: dict[str, NDArray[Any]]) -> None:
        """Windows of samples and noises of the filters, and the motion."""
        self.motion.restore(arrays)
        if isinstance(self.model.sea, ArmaSea):
            count = sum(name.startswith("index.") for name in arrays)
            self.model.sea.set_state(
                [
                    ProcessState(
                        index=int(arrays[f"index.{j}"]), samples=arrays[f"samples.{j}"], noises=arrays[f"noises.{j}"]
                    )
                    for j in range(count)
                ]
            )
