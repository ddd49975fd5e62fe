"""The tendons: straight weightless elastic lines between fairleads on the hull and anchors on the sea bed.

    d = anchor - (x + R fairlead),   l = |d|,   T = max(0, EA (l - l0)/l0)
    force on the platform T d/l, moment (R fairlead) x force;   l0 = l(zero pose) / (1 + T0/EA)

The geometry is exact at any offset and rotation, so setdown and its coupling with yaw come by themselves.
A slack tendon carries nothing. Hydrodynamic loads and inertia of the tendons are left out.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tlpsim.loads.errors import ScenarioError
from tlpsim.loads.platform.body import fixed_array, rotation_matrix


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tendons:
    """A set of n tendons; n may be zero for a body that floats freely.

    Attributes
    ----------
    fairleads : (n, 3) m, upper ends from the reference point, fixed in the body.
    anchors : (n, 3) m, lower ends, earth-fixed.
    axial_stiffness : (n,) N, EA of each tendon, > 0.
    pretension : (n,) N, tension at zero pose, >= 0.
    unstretched_length : (n,) m, derived so that the tension at zero pose is the pretension.

    Raises
    ------
    ScenarioError
        For a wrong shape, a value out of range, or a tendon of no length.
    """

    fairleads: NDArray[np.float64]
    anchors: NDArray[np.float64]
    axial_stiffness: NDArray[np.float64]
    pretension: NDArray[np.float64]
    unstretched_length: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        fairleads = fixed_array(self.fairleads, (-1, 3), "tendon fairleads")
        count = len(fairleads)
        anchors = fixed_array(self.anchors, (count, 3), "tendon anchors")
        axial_stiffness = fixed_array(self.axial_stiffness, (count,), "tendon axial_stiffness")
        pretension = fixed_array(self.pretension, (count,), "tendon pretension")
        length = np.linalg.norm(anchors - fairleads, axis=1)
        for name, values, bad, limit in (
            ("axial_stiffness", axial_stiffness, axial_stiffness <= 0.0, "> 0 N"),
            ("pretension", pretension, pretension < 0.0, ">= 0 N"),
            ("length", length, length <= 0.0, "> 0 m between fairlead and anchor"),
        ):
            if np.any(bad):
                index = int(np.argmax(bad))
                raise ScenarioError(f"tendon {index + 1} has {name} {values[index]:.6g}, expected {limit}")
        unstretched = fixed_array(length / (1.0 + pretension / axial_stiffness), (count,), "unstretched_length")
        for name, array in (
            ("fairleads", fairleads),
            ("anchors", anchors),
            ("axial_stiffness", axial_stiffness),
            ("pretension", pretension),
            ("unstretched_length", unstretched),
        ):
            object.__setattr__(self, name, array)


def _lines(tendons: Tendons, pose: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Levers R f and directions (n, 3), tensions and elongations (n,), these two cut off at zero."""
    levers = tendons.fairleads @ rotation_matrix(pose[3:]).T
    spans = tendons.anchors - (pose[:3] + levers)
    lengths = np.sqrt(np.sum(spans * spans, axis=1))  # not norm(): it would drop a complex step
    stretch = lengths - tendons.unstretched_length
    elongations = np.where(stretch.real > 0.0, stretch, 0.0)
    tensions = tendons.axial_stiffness * elongations / tendons.unstretched_length
    return levers, spans / lengths[:, None], tensions, elongations


def tendon_loads(tendons: Tendons, pose: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Load of all tendons on the platform, and the tension of each.

    Parameters
    ----------
    pose : (6,) m, rad.

    Returns
    -------
    load : (6,) N, N·m, earth-fixed, about the reference point.
    tensions : (n,) N, zero where slack.
    """
    levers, directions, tensions, _ = _lines(tendons, pose)
    forces = tensions[:, None] * directions
    moments = np.cross(levers, forces)
    return np.concatenate((forces.sum(axis=0), moments.sum(axis=0))), tensions


def tendon_energy(tendons: Tendons, pose: NDArray[Any]) -> Any:
    """Elastic energy of all tendons, J, zero when none is stretched."""
    _, _, tensions, elongations = _lines(tendons, pose)
    return 0.5 * np.sum(tensions * elongations)
