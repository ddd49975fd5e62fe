"""The platform's integrator: energy over a thousand surge periods, loss of tendons, large yaw, time of a step.

.venv/bin/python benchmarks/platform_motion.py [--quick]
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from report import Row, at_least, at_most, main

from tlpsim.loads import issc_tlp
from tlpsim.loads.platform.equilibrium import mechanical_energy, single_periods, static_equilibrium
from tlpsim.loads.platform.motion import METHODS, PlatformModel, advance, initial_state, remaining, set_intact
from tlpsim.loads.platform.tendons import tendon_loads

FloatArray = NDArray[np.float64]

STEP = 0.1
REST = np.zeros(6)
RELEASES = {
    "offset by wind": (np.array([2.6e6, 1.0e6, 0.0, 0.0, 0.0, 2.0e7]), REST),
    "19 m and 13° of yaw": (np.array([6e6, 3e6, 0.0, 0.0, 0.0, 3e8]), np.array([0.3, -0.5, 0.0, 0.0, 0.0, 0.02])),
}
LOSSES = {"one tendon": (0,), "two of one column": (0, 1), "one of each column": (0, 3, 6, 9)}


def undamped(method: str = "fox_goodwin") -> PlatformModel:
    return replace(issc_tlp.platform(np.zeros(6)), method=method)


def energy_drift(model: PlatformModel, force: FloatArray, velocity: FloatArray, periods: float) -> tuple[float, float]:
    """Relative drift and largest deviation of the energy after a release, over a number of surge periods."""
    state = initial_state(model, static_equilibrium(model, force), velocity, REST)
    start, energies = mechanical_energy(model, state), []
    for n in range(int(periods * single_periods(model)[0] / STEP)):
        advance(model, state, REST, STEP)
        if n % 97 == 0:  # no divisor of a mode's period
            energies.append(mechanical_energy(model, state) / start - 1.0)
    part = len(energies) // 20
    return abs(float(np.mean(energies[-part:]) - np.mean(energies[:part]))), float(np.abs(energies).max())


def energy(quick: bool) -> list[Row]:
    """Energy of the undamped platform."""
    periods, rows = 50 if quick else 1000, []
    for name, (force, velocity) in RELEASES.items():
        for method in METHODS:
            if method != "fox_goodwin" and (quick or name != "offset by wind"):
                continue
            drift, deviation = energy_drift(undamped(method), force, velocity, periods)
            item = f"energy over {periods} surge periods, {method}, {name}"
            rows.append(at_most(f"{item}: drift", 100.0 * drift, 0.1, "%"))
            rows.append(at_most(f"{item}: largest deviation", 100.0 * deviation, 0.1, "%"))
    return rows


def loss(quick: bool) -> list[Row]:
    """Sudden loss of tendons at rest: how tension goes over to the others."""
    rows = []
    for name, lost in LOSSES.items():
        kept = ~np.isin(np.arange(12), lost)
        for model, kind in ((undamped(), "undamped"), (issc_tlp.platform(), "2 % damping")):
            state = initial_state(model, REST, REST, REST)
            left = remaining(model, kept)
            before = state.tensions[kept].copy()
            static = tendon_loads(left.tendons, static_equilibrium(left, REST))[1] - before
            set_intact(model, state, kept)
            record = []
            for _ in range(3000):
                advance(model, state, REST, STEP)
                record.append(state.tensions.copy())
            tensions = np.array(record)
            worst = int(np.argmax(static))
            peak = float(tensions[:, kept][:, worst].max() - before[worst])
            item = f"loss of {name}, {kind}"
            rows.append(at_most(f"{item}: overshoot of the static step", peak / static[worst], 2.001, form=".4f"))
            if kind != "undamped":
                settled = tensions[-200:, kept].mean(axis=0) - before
                error = np.abs(settled - static).max() / static.max()
                rows.append(at_most(f"{item}: redistribution against equilibrium", 100.0 * error, 0.1, "%"))
            wrong = float(np.abs(tensions[:, ~kept]).max() + np.sum(~np.isfinite(tensions)))
            rows.append(at_most(f"{item}: tension of lost ones, and values that are no numbers", wrong, 0.0))
    return rows


def tubes(quick: bool) -> list[Row]:
    """What mass and drag of the tethers do."""
    plain = undamped()
    steel = replace(plain, tendons=issc_tlp.tendons(tubes=issc_tlp.steel_tubes()))
    longer = 100.0 * (single_periods(steel) / single_periods(plain) - 1.0)
    rows = [
        Row(item=f"steel tubes: natural period of {name}", measured=f"{longer[i]:+.2f} %")
        for i, name in ((0, "surge"), (2, "heave"), (4, "pitch"), (5, "yaw"))
    ]
    state = initial_state(steel, [10.0, 0.0, 0.0, 0.0, 0.0, 0.0], REST, REST)
    peaks = []
    for _ in range(round(10 * single_periods(steel)[0] / STEP)):
        before = state.velocity[0]
        advance(steel, state, REST, STEP)
        if before > 0.0 >= state.velocity[0]:
            peaks.append(state.position[0])
    rows.append(Row(item="steel tubes: surge of 10 m by drag alone, after 9 periods", measured=f"{peaks[8]:.2f} m"))
    return rows


def speed(quick: bool) -> list[Row]:
    """Time of a step."""
    rows = []
    steel = issc_tlp.tendons(tubes=issc_tlp.steel_tubes())
    for name, model in (("massless tethers", issc_tlp.platform()), ("steel tubes", replace(undamped(), tendons=steel))):
        state = initial_state(model, [5.0, 2.0, 0.0, 0.0, 0.0, 0.1], [0.5, 0, 0, 0, 0, 0], REST)
        advance(model, state, REST, STEP)
        count = 2000 if quick else 20_000
        began = time.perf_counter()
        for _ in range(count):
            advance(model, state, REST, STEP)
        real_time = STEP * count / (time.perf_counter() - began)
        rows.append(at_least(f"integration from Python, {name}", real_time, 5000.0, "× real time", ".0f"))
    return rows


if __name__ == "__main__":
    main("Motion of the platform", [energy, loss, tubes, speed])
