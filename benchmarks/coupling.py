"""Order and stability of the algorithms that step a loop: python benchmarks/coupling.py; figures for docs/coupling.md.

Two problems whose components are exact but for their coupling:

- Dahlquist's, x' = u of one component and u = lambda x of the other, of which the growth in a step is a root of a
  polynomial that is known for each algorithm; the master's runs are held against it
- two masses on springs, joined by a spring and a damper (tests/orchestrator/linear_systems.py)

The figures go to docs/figures.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import NDArray
from report import Row, main, within

from tlpsim.loads.errors import StepError
from tlpsim.orchestrator.execution import run
from tlpsim.orchestrator.instance import PythonInstance
from tlpsim.orchestrator.observers import MemoryRecorder
from tlpsim.orchestrator.system import Component, Connection, Iteration, System

DAMPING_RATIO = 0.05
ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests" / "orchestrator"))
from linear_systems import MILLISECOND, SECOND, TwoMasses, linear_component  # noqa: E402

FloatArray = NDArray[np.float64]

COLOURS = {"black": "black", "blue": "#4ba3e3", "red": "#d62728", "green": "#2ca02c"}

# (algorithm, extrapolation) -> coefficients a, b of sum a_k g^k = z sum b_k g^k, highest power first, for the growth g
# in a step and z = lambda h. The integrator takes inputs v for linear over its step, x_n+1 = x_n + h (v_n + v_n+1) / 2,
# and v_n+1 is what u_n, u_n-1 ... are continued to; with parallel steps u_n is lambda times a continued x, too.
POLYNOMIALS: dict[tuple[str, str], tuple[list[float], list[float]]] = {
    ("multirate", "hold"): ([1, -1, 0], [0, 0.5, 0.5]),
    ("multirate", "linear"): ([1, -1, 0, 0], [0, 1, 0.5, -0.5]),
    ("multirate", "quadratic"): ([1, -1, 0, 0, 0], [0, 1.5, 0, -1, 0.5]),
    ("parallel", "linear"): ([1, -1, 0, 0, 0, 0], [0, 0, 2, 0, -1.5, 0.5]),
    ("iterative", "linear"): ([1, -1], [0.5, 0.5]),
}
STYLES: dict[tuple[str, str], dict[str, Any]] = {
    ("multirate", "hold"): {"colors": "grey", "linewidths": 1.4},
    ("multirate", "linear"): {"colors": COLOURS["black"], "linewidths": 2.6},
    ("multirate", "quadratic"): {"colors": COLOURS["blue"], "linewidths": 1.4},
    ("parallel", "linear"): {"colors": COLOURS["red"], "linewidths": 1.6, "linestyles": [(0, (5, 3))]},
    ("iterative", "linear"): {"colors": COLOURS["green"], "linewidths": 1.6},
}


def growth(choice: tuple[str, str], z: NDArray[np.complex128]) -> FloatArray:
    """Growth in a step by the polynomial, shape of `z`: the largest eigenvalue of its companion matrix."""
    a, b = (np.array(each, dtype=np.complex128) for each in POLYNOMIALS[choice])
    polynomial = a - z.ravel()[:, np.newaxis] * b
    degree = len(a) - 1
    matrix = np.zeros((z.size, degree, degree), dtype=np.complex128)
    matrix[:, 1:, :-1] = np.eye(degree - 1)
    matrix[:, 0, :] = -polynomial[:, 1:] / polynomial[:, :1]
    return np.asarray(np.abs(np.linalg.eigvals(matrix)).max(axis=1).reshape(z.shape))


def dahlquist(choice: tuple[str, str], z: complex, steps: int) -> float:
    """Growth in a step by a run of the master with steps of 1 s: real and imaginary part are two states."""
    gain = np.array([[z.real, -z.imag], [z.imag, z.real]])
    names = ["u", "w"]
    integrator = linear_component(
        "integrator", np.zeros((2, 2)), np.eye(2), np.eye(2), np.zeros((2, 2)), np.array([1.0, 0.0]), names, ["x", "y"]
    )

    def give(values: Any, time: float, size: float = 0.0) -> None:
        values["u"], values["w"] = (gain @ [values["x"], values["y"]]).tolist()

    other = PythonInstance("gain", give, inputs={"x": 1.0, "y": 0.0}, outputs={"u": 0.0, "w": 0.0}, initialize=give)
    algorithm, extrapolation = choice
    wires = [
        ("integrator", "x", "gain"),
        ("integrator", "y", "gain"),
        ("gain", "u", "integrator"),
        ("gain", "w", "integrator"),
    ]
    system = System(
        components=(Component(instance=integrator, step=SECOND), Component(instance=other, step=SECOND)),
        connections=tuple(
            Connection(source=a, source_variable=name, target=b, target_variable=name, extrapolation=extrapolation)
            for a, name, b in wires
        ),
        algorithm=algorithm,
        iteration=Iteration(tolerance=1e-12),
    )
    recorder = MemoryRecorder()
    run(system, steps * SECOND, observers=[recorder])
    size = np.hypot(recorder.signal("integrator", "x"), recorder.signal("integrator", "y"))
    return _growth(size)


def _growth(size: FloatArray) -> float:
    """Growth in a step of the envelope, from the second to the fourth quarter of a record."""
    quarter = len(size) // 4
    begin, end = quarter, len(size) - quarter
    return float((size[end:].max() / size[begin : begin + quarter].max()) ** (1.0 / (end - begin)))


def two_masses_error(problem: TwoMasses, steps: tuple[int, int], algorithm: str, extrapolation: str) -> float:
    """Largest error of the position of the first mass over 4 s, steps in ms."""
    recorder = MemoryRecorder()
    run(problem.system(steps, algorithm, extrapolation), 4 * SECOND, observers=[recorder])
    return float(np.max(np.abs(recorder.signal("first", "x") - problem.exact(recorder.times("first")))))


def two_masses_growth(stiffness: float, algorithm: str, step: int = 20, count: int = 320) -> float:
    """Growth in a step of the force between two equal masses; not a number where the iteration does not converge."""
    damping = DAMPING_RATIO * np.sqrt(2.0 * stiffness)  # of the motion of the masses against each other
    problem = TwoMasses(masses=(1.0, 1.0), springs=(1.0, 1.0), k=stiffness, c=float(damping))
    recorder = MemoryRecorder()
    try:
        run(problem.system((step, step), algorithm), count * step * MILLISECOND, observers=[recorder])
    except StepError:
        return float("nan")
    return _growth(np.abs(recorder.signal("second", "f")))


def order(quick: bool) -> list[Row]:
    """Error over step, by algorithm and by extrapolation."""
    rows = []
    problem, steps = TwoMasses(), np.array([80, 40, 20, 10])
    figure = Figure(figsize=(11.0, 4.6), layout="constrained", dpi=110)
    figure.suptitle("Two masses: largest error of the position over 4 s", fontsize=13)
    left, right = figure.subplots(1, 2, sharey=True)
    lines = [
        (left, (1, 1), "multirate", "derivatives", "multirate, sequential", {"color": "black", "linewidth": 2.6}),
        (left, (1, 1), "parallel", "derivatives", "parallel", {"color": COLOURS["red"], "dashes": (5, 3)}),
        (left, (1, 1), "iterative", "derivatives", "iterative", {"color": COLOURS["green"]}),
        (right, (1, 5), "multirate", "hold", "hold", {"color": "grey"}),
        (right, (1, 5), "multirate", "linear", "linear", {"color": "black", "linewidth": 2.6}),
        (right, (1, 5), "multirate", "quadratic", "quadratic", {"color": COLOURS["blue"]}),
        (right, (1, 5), "multirate", "derivatives", "derivatives", {"color": COLOURS["red"], "dashes": (5, 3)}),
    ]
    for axes, ratio, algorithm, extrapolation, label, style in lines:
        errors = [
            two_masses_error(problem, (h * ratio[0], h * ratio[1]), algorithm, extrapolation) for h in steps.tolist()
        ]
        axes.loglog(1e-3 * max(ratio) * steps, errors, marker="o", markersize=4, label=label, **style)
        slope = float(np.log2(errors[-2] / errors[-1]))
        expected = 1.0 if extrapolation == "hold" else 2.0
        rows.append(within(f"order of {label}, steps {ratio[0]}:{ratio[1]}", slope, expected, 0.1))
    for axes, title in ((left, "by algorithm, equal steps"), (right, "by extrapolation, multirate, steps 1:5")):
        axes.set(title=title, xlabel="larger step, s")
        _finish(axes)
    left.set_ylabel("error, m")
    _write(figure, "coupling_order.png")
    return rows


def stability(quick: bool) -> list[Row]:
    """Where Dahlquist's problem does not grow, and the growth of two masses over the stiffness of their coupling."""
    rows = []
    figure = Figure(figsize=(11.0, 4.8), layout="constrained", dpi=110)
    plane, masses = figure.subplots(1, 2)
    real, imaginary = np.linspace(-2.4, 0.6, 151), np.linspace(-1.6, 1.6, 161)
    z = real[np.newaxis, :] + 1j * imaginary[:, np.newaxis]
    for choice, style in STYLES.items():
        plane.contour(real, imaginary, growth(choice, z), levels=[1.0 + 1e-9], **style)
        colour = style["colors"]
        dashes = {"dashes": (5, 3)} if "linestyles" in style else {}
        plane.plot([], [], color=colour, linewidth=style["linewidths"], label=", ".join(choice), **dashes)
        for value in (-0.3 + 0.2j, -0.6 + 0.4j, -1.1 + 0.3j):
            expected = float(growth(choice, np.array([value]))[0])
            # until it has shrunk to a millionth, above what rounding and the iteration leave
            steps = int(np.clip(np.log(1e-6) / min(np.log(expected), -0.05), 20, 120))
            found = dahlquist(choice, value, steps)
            name = f"growth, {choice[0]}, {choice[1]}, λh = {value:.2g}"
            rows.append(within(name, found, expected, 0.01))
    plane.axhline(0.0, color="0.8", linewidth=0.7, zorder=0)
    plane.axvline(0.0, color="0.8", linewidth=0.7, zorder=0)
    plane.set(title="x' = λx in two components: stable inside", xlabel="Re λh", ylabel="Im λh", aspect="equal")
    stiffness = np.logspace(1.0, 4.0, 19)
    for algorithm, style in (
        ("multirate", {"color": "black", "linewidth": 2.6}),
        ("parallel", {"color": COLOURS["red"], "dashes": (5, 3)}),
        ("iterative", {"color": COLOURS["green"]}),
    ):
        growths = np.array([two_masses_growth(float(k), algorithm) for k in stiffness])
        masses.semilogx(stiffness * 0.02**2, growths, label=algorithm, **style)
        stable = stiffness[growths < 1.0] * 0.02**2
        masses.set_ylim(0.9, 1.6)
        rows.append(Row(item=f"largest stable k h²/m, {algorithm}", measured=f"{stable.max(initial=0.0):.3g}"))
    masses.set(
        title="two equal masses, spring k and 5 % damping between them", xlabel="$k h^2 / m$", ylabel="growth in a step"
    )
    for axes in (plane, masses):
        _finish(axes)
    _write(figure, "coupling_stability.png")
    return rows


def _finish(axes: Any) -> None:
    axes.grid(True, which="major", color="0.88", linewidth=0.7)
    for axis in (axes.xaxis, axes.yaxis):
        if axis.get_scale() == "log":
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if axis is axes.xaxis else (1.0,)))
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axis.set_minor_formatter(NullFormatter())
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, fontsize=9, loc="best")


def _write(figure: Figure, name: str) -> None:
    folder = ROOT / "docs" / "figures"
    folder.mkdir(exist_ok=True)
    FigureCanvasAgg(figure).print_png(str(folder / name))


if __name__ == "__main__":
    main("Loops: order and stability", [order, stability])
