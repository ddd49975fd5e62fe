"""A platform as a vendor might make it: six oscillators in kN and degrees, under names of their own (pythonfmu)."""

import ctypes

# pythonfmu 0.7 gives back, at every instantiation, a reference to this module's globals that it never took.
ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))

import math  # noqa: E402

from pythonfmu import Fmi2Causality, Fmi2Slave, Real  # noqa: E402

MASS = (8.0e7, 8.0e7, 8.0e8, 1.5e11, 1.5e11, 1.5e11)  # kg, kg.m2
STIFFNESS = (3.0e5, 3.0e5, 8.0e9, 1.5e12, 1.5e12, 9.0e8)  # N/m, N.m/rad
DAMPING = (1.0e6, 1.0e6, 1.0e8, 2.0e10, 2.0e10, 2.0e9)  # N.s/m, N.m.s/rad
AXES = ("x", "y", "z", "phi", "theta", "psi")
LOADS = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")


class VendorPlatform(Fmi2Slave):
    author = "a vendor"
    description = "six oscillators"

    def __init__(self, **kwargs):  # type: ignore[no-untyped-def]
        super().__init__(**kwargs)
        self.force = {name: 0.0 for group in ("wind", "hydro") for name in (f"{group}Load.{axis}" for axis in LOADS)}
        self.units: dict[str, str] = {}
        self.motion, self.rate, self.before = [0.0] * 6, [0.0] * 6, [0.0] * 6
        for name in self.force:
            unit = "kN" if ".F" in name else "kN.m"
            self._declare(name, Fmi2Causality.input, unit, lambda n=name: self.force[n], self._setter(self.force, name))
        for i, axis in enumerate(AXES):
            units = ("m", "m/s") if i < 3 else ("deg", "deg/s")
            scale = 1.0 if i < 3 else 180.0 / math.pi
            for group, values, unit in (("pos", self.motion, units[0]), ("vel", self.rate, units[1])):
                getter = lambda v=values, i=i, s=scale: s * v[i]  # noqa: E731
                self._declare(f"{group}.{axis}", Fmi2Causality.output, unit, getter, None)

    @staticmethod
    def _setter(into, name):  # type: ignore[no-untyped-def]
        return lambda value: into.__setitem__(name, value)

    def _declare(self, name, causality, unit, getter, setter):  # type: ignore[no-untyped-def]
        options = {"start": 0.0} if setter else {}
        self.units[name] = unit
        self.register_variable(Real(name, causality=causality, getter=getter, setter=setter, **options))

    def to_xml(self, *arguments, **options):  # type: ignore[no-untyped-def]
        """The model description with units, by name only, as many tools write them."""
        root = super().to_xml(*arguments, **options)
        for scalar in root.iter("ScalarVariable"):
            scalar[0].set("unit", self.units[scalar.get("name")])
        return root

    def exit_initialization_mode(self) -> None:
        self.before = self._loads()

    def _loads(self) -> list[float]:
        return [1e3 * (self.force[f"windLoad.{axis}"] + self.force[f"hydroLoad.{axis}"]) for axis in LOADS]

    def do_step(self, time: float, size: float) -> bool:
        """Average acceleration, with the loads linear over the step."""
        after = self._loads()
        for i in range(6):
            m, c, k = MASS[i], DAMPING[i], STIFFNESS[i]
            old, x, v = (self.before[i] - c * self.rate[i] - k * self.motion[i]) / m, self.motion[i], self.rate[i]
            effective = m + 0.5 * size * c + 0.25 * size**2 * k
            guess_x, guess_v = x + size * v + 0.25 * size**2 * old, v + 0.5 * size * old
            new = (after[i] - c * guess_v - k * guess_x) / effective
            self.motion[i], self.rate[i] = guess_x + 0.25 * size**2 * new, guess_v + 0.5 * size * new
        self.before = after
        return True
