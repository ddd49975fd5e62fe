"""Linear components that are exact but for their coupling, the two-mass problem made of them, and what it must give."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from tlpsim.orchestrator.instance import PythonInstance, Values
from tlpsim.orchestrator.system import Component, Connection, Iteration, System

MILLISECOND = 1_000_000
SECOND = 1000 * MILLISECOND

Matrix = NDArray[np.float64]


def exact_step(a: Matrix, b: Matrix, size: float) -> tuple[Matrix, Matrix, Matrix]:
    """x(h) = p x(0) + q0 u(0) + q1 u(h) of x' = a x + b u with u linear over the step."""
    n, m = b.shape
    whole = np.zeros((n + 2 * m, n + 2 * m))
    whole[:n, :n], whole[:n, n : n + m] = a, b
    whole[n : n + m, n + m :] = np.eye(m) / size
    found = expm(size * whole)
    return found[:n, :n], found[:n, n : n + m] - found[:n, n + m :], found[:n, n + m :]


def linear_component(
    name: str, a: Matrix, b: Matrix, c: Matrix, d: Matrix, start: Matrix, inputs: list[str], outputs: list[str]
) -> PythonInstance:
    """x' = a x + b u, y = c x + d u, solved exactly for inputs that are linear over a step."""
    matrices: dict[float, tuple[Matrix, Matrix, Matrix]] = {}

    def give(values: Values, time: float) -> None:
        given = np.array([values[name] for name in inputs])
        values["before"] = given
        values.update(zip(outputs, (c @ values.get("state", start) + d @ given).tolist(), strict=True))

    def step(values: Values, time: float, size: float) -> None:
        p, q0, q1 = matrices.setdefault(size, exact_step(a, b, size))
        given = np.array([values[name] for name in inputs])
        values["state"] = p @ values.get("state", start) + q0 @ values["before"] + q1 @ given
        give(values, time)

    derivatives = {"v": "x", "a": "v"} if {"x", "v", "a"} <= set(outputs) else {}
    return PythonInstance(
        name,
        step,
        inputs=dict.fromkeys(inputs, 0.0),
        outputs=dict.fromkeys(outputs, 0.0),
        initialize=give,
        derivatives=derivatives,
    )


class TwoMasses:
    """m1 x1'' + k1 x1 = f, m2 x2'' + k2 x2 = -f, f = k (x2 - x1) + c (x2' - x1').

    The second component gives the force, and gets the motion of the first.
    """

    def __init__(
        self,
        masses: tuple[float, float] = (2.0, 1.0),
        springs: tuple[float, float] = (8.0, 3.0),
        k: float = 1.5,
        c: float = 0.3,
    ) -> None:
        (m1, m2), (k1, k2) = masses, springs
        self.a1 = np.array([[0.0, 1.0], [-k1 / m1, 0.0]])
        self.b1 = np.array([[0.0], [1.0 / m1]])
        self.c1 = np.array([[1.0, 0.0], [0.0, 1.0], [-k1 / m1, 0.0]])
        self.d1 = np.array([[0.0], [0.0], [1.0 / m1]])
        self.a2 = np.array([[0.0, 1.0], [-(k2 + k) / m2, -c / m2]])
        self.b2 = np.array([[0.0, 0.0], [k / m2, c / m2]])
        self.c2 = np.array([[k, c]])
        self.d2 = np.array([[-k, -c]])
        self.start = np.array([1.0, 0.0]), np.array([0.0, 0.0])

    def system(
        self, steps: tuple[int, int], algorithm: str, extrapolation: str = "derivatives", **rule: object
    ) -> System:
        """The two as components with steps in ms."""
        first = linear_component("first", self.a1, self.b1, self.c1, self.d1, self.start[0], ["f"], ["x", "v", "a"])
        second = linear_component("second", self.a2, self.b2, self.c2, self.d2, self.start[1], ["x", "v"], ["f"])

        def wire(source: str, name: str, target: str) -> Connection:
            return Connection(
                source=source, source_variable=name, target=target, target_variable=name, extrapolation=extrapolation
            )

        return System(
            components=tuple(
                Component(instance=one, step=step * MILLISECOND)
                for one, step in zip((first, second), steps, strict=True)
            ),
            connections=(wire("first", "x", "second"), wire("first", "v", "second"), wire("second", "f", "first")),
            algorithm=algorithm,
            iteration=Iteration(**rule),  # type: ignore[arg-type]
        )

    def exact(self, times: Matrix) -> Matrix:
        """Position of the first mass."""
        whole = np.block(
            [
                [self.a1 + self.b1 @ self.d2 @ np.eye(2), self.b1 @ self.c2],
                [self.b2, self.a2],
            ]
        )
        values, vectors = np.linalg.eig(whole)
        amplitudes = np.linalg.solve(vectors, np.concatenate(self.start))
        return np.asarray(np.real(np.exp(np.outer(times, values)) @ (vectors[0] * amplitudes)))

    def implicit(self, size: float, count: int) -> Matrix:
        """Position of the first mass at each step where inputs that are linear over a step are those of its end.

        The equations of a step, both components and their coupling, are solved together.
        """
        p1, q10, q11 = exact_step(self.a1, self.b1, size)
        p2, q20, q21 = exact_step(self.a2, self.b2, size)
        # Unknown: x1 (2), x2 (2), f (1); the motion that the second gets is x1.
        whole = np.zeros((5, 5))
        whole[:2, :2], whole[:2, 4:] = np.eye(2), -q11
        whole[2:4, 2:4], whole[2:4, :2] = np.eye(2), -q21
        whole[4, 4], whole[4, 2:4], whole[4, :2] = 1.0, -self.c2[0], -self.d2[0]
        one, two = self.start
        force = self.c2 @ two + self.d2 @ one
        result = [one[0]]
        for _ in range(count):
            right = np.concatenate([p1 @ one + q10 @ force, p2 @ two + q20 @ one, [0.0]])
            found = np.linalg.solve(whole, right)
            one, two, force = found[:2], found[2:4], found[4:]
            result.append(one[0])
        return np.array(result)
