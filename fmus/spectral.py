"""The frequency domain's view of the models in the FMUs: the same parameters, as statistics.

Each function takes `parameter`, which gives the value of an FMU's parameter by name, as the FMUs' own models do.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tlpsim.fmus.current import current_of
from tlpsim.fmus.wave_parameters import (
    drift_damping,
    drift_source,
    hull_members,
    sea_state,
    wave_database,
)
from tlpsim.fmus.wind_fmu import wind_gusts, wind_profile, wind_segments
from tlpsim.loads.hydro.diffraction import excitation
from tlpsim.loads.hydro.drift import newman_kernel
from tlpsim.loads.spectral.model import SpectralWaves, SpectralWind
from tlpsim.loads.wind.field import gust_spectrum
from tlpsim.loads.wind.segments import default_segments

Parameter = Callable[[str], Any]


def spectral_waves(parameter: Parameter) -> SpectralWaves:
    """Waves and current from the wave FMU's parameters."""
    database = wave_database(parameter)
    source = drift_source(parameter, database)
    kernel = newman_kernel(*source) if isinstance(source, tuple) else source
    damped = kernel is not None and database is not None
    return SpectralWaves(
        state=sea_state(parameter),
        members=hull_members(parameter),
        water_density=parameter("water_density"),
        current=current_of(parameter),
        excitation=None if database is None else excitation(database),
        drift=kernel,
        drift_damping=drift_damping(parameter, database) if damped and database is not None else None,
        splash=parameter("splash"),
        stretching=parameter("stretching"),
        displaced_position=parameter("displaced_position"),
        doppler=parameter("doppler"),
        sharp_band=parameter("generator") == "harmonic",
    )


def spectral_wind(parameter: Parameter) -> SpectralWind:
    """Wind from the wind FMU's parameters, with the gusts up to the Nyquist frequency of their samples."""
    heading, profile, gusts = parameter("heading"), wind_profile(parameter), wind_gusts(parameter)
    segments = wind_segments(parameter)
    areas = default_segments(heading) if segments is None else segments
    common: dict[str, Any] = {
        "segments": areas,
        "heading": heading,
        "air_density": parameter("air_density"),
        "decomposition": parameter("decomposition"),
        "highest_frequency": 0.5 / gusts.sampling_step,
    }
    if profile.speed_10 == 0.0:
        count = len(areas.area)
        return SpectralWind(
            speed=np.zeros(count),
            spectrum=lambda frequency: np.zeros((len(frequency), count, count), dtype=np.complex128),
            **common,
        )
    speed, spectrum = gust_spectrum(
        position=areas.position, area=areas.area, heading=heading, profile=profile, gusts=gusts
    )
    return SpectralWind(speed=speed, spectrum=lambda frequency: spectrum(frequency).astype(np.complex128), **common)
