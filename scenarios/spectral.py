"""A scenario in the frequency domain: the same sections and parameters, without time stepping."""

from __future__ import annotations

import numpy as np

from tlpsim.fmus.spectral import spectral_waves, spectral_wind
from tlpsim.fmus.wave_fmu import TlpsimWave
from tlpsim.fmus.wind_fmu import TlpsimWind
from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.platform.motion import remaining
from tlpsim.loads.spectral.model import SpectralModel
from tlpsim.loads.spectral.records import SpectralResponse
from tlpsim.loads.spectral.response import respond
from tlpsim.orchestrator.clock import to_seconds, to_ticks
from tlpsim.scenarios.assemble import blamed_on
from tlpsim.scenarios.monolithic import parts
from tlpsim.scenarios.parameters import parameter_values
from tlpsim.scenarios.schema import Scenario


def spectral_model(scenario: Scenario) -> SpectralModel:
    """The models of a scenario's built-in components, by their statistics.

    Raises
    ------
    ScenarioError
        When the scenario has a component, a name or a connection that only a co-simulation can have, or a parameter is
        out of range.
    WiringError
        When a parameter does not exist or is of the wrong type.
    """
    if scenario.events:
        raise ScenarioError("events: the frequency domain has no times at which something changes; leave them out")
    found = parts(scenario, "the frequency domain")
    wind, waves = None, None
    if "wind" in scenario.components:
        with blamed_on("wind"):
            wind = spectral_wind(parameter_values(TlpsimWind, found.parameters["wind"]))
    if "wave" in scenario.components:
        with blamed_on("wave"):
            waves = spectral_waves(parameter_values(TlpsimWave, found.parameters["wave"]))
    platform = found.platform if found.intact.all() else remaining(found.platform, found.intact)
    return SpectralModel(
        platform=platform,
        wind=wind,
        waves=waves,
        external=found.external,
        points=found.points,
        tendons=np.flatnonzero(found.intact) + 1,
        step=to_seconds(to_ticks(scenario.components["platform"].step, "components.platform.step")),
    )


def spectral_response(scenario: Scenario) -> SpectralResponse:
    """Response statistics of a scenario by the frequency domain.

    Raises
    ------
    ScenarioError, WiringError
        As `spectral_model`.
    SolverError
        When there is no mean position, no stationary response, or the iteration does not converge.
    """
    return respond(spectral_model(scenario))
