"""MSSP 2015 made whole: plant and drive that the paper leaves open, in a closed loop of FMUs, fitted to all it reports.

::

    reference [-> compensator] -> lag -> PID -> motor, gear -> backlash -> load;  friction loads the motor

The paper prints one backlash set and uses it twice, as the model of the plant and in the compensator; it prints no
controller, no gear and no window. A `Completion` says what the rig was instead. The compensator keeps the published
numbers, or has those of the plant (``own``).

The fit is in co-simulation: a model of the loop with a linear drive (`ideal`: kernels, lag, and the motor without
friction or limits in its position loop, in milliseconds) is searched, and what it misses of the co-simulated numbers is
added to it before the next search (space mapping). It is done at each of `BANDWIDTHS`: the position loop is free too.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import control
import numpy as np
from scipy.optimize import differential_evolution, minimize
from scipy.signal import lfilter

from ...cosim.ssp import Case
from ...cosim.system import Experiment, System
from ...kernels.arrays import FloatArray
from ...kernels.kernel import kernel
from ...scenarios import mssp_feedforward
from ...scenarios.pid_design import PidDesign, controller_model, design_pid, motor_model
from ..loops import FMUS, co_simulate, side_by_side
from .printed import MOTIONS, TRACKED

GEAR = 134.0
"""Of the same motor in ICINCO 2013; MSSP 2015 prints none."""
COUNT = math.radians(360.0 / (4.0 * 3600.0))
"""Of the follower's encoder, E6D-CWZ1E 3600P/R (Section 4), both edges of both channels [rad]."""
EXPERIMENT = Experiment(stop=40.0, step=2e-3, evaluate_from=5.0, tracking_error="error.y", loops="delay")
"""The window is not published; the non-periodic motion needs 30 s or more to come near its largest strokes."""
SHORT = Experiment(stop=10.0, step=2e-3, evaluate_from=5.0, tracking_error="error.y", loops="delay")
"""For tests: one period."""
WITH_EFFECTS = {"PidController": "PidController+sensor_lag@r", "Sum": "Sum+quantisation@u2"}
"""The command reaches the position loop with a lag; the error is that of the follower's encoder."""
SEARCHED: dict[str, tuple[float, float]] = {
    "c": (0.95, 1.05),
    "B": (0.05, 1.0),
    "alpha": (2.0, 12.0),
    "lag": (0.0, 0.04),
}
"""Admissible values of what is open: gain, slope and rate of the plant, and the lag of its drive."""
BANDWIDTHS = (30.0, 60.0, 100.0, 170.0, 300.0)
"""Of the position loop [rad/s]; the others are searched at each of them."""
NAMES = tuple(TRACKED)


@dataclass(frozen=True)
class Completion:
    """What the paper leaves open.

    Attributes
    ----------
    c, B, alpha : float
        Backlash of the plant, Eq. (8) [1, 1, 1/rad].
    lag : float
        Time constant between the command and the reference of the position loop [s].
    crossover : float
        Of the position loop [rad/s]; infinite in `ideal` alone: the motor follows its command exactly.
    own : bool
        The compensator has the numbers of the plant instead of the published ones.
    still : bool
        The drive follows its command exactly: no lag is searched.
    """

    c: float
    B: float
    alpha: float
    lag: float = 0.0
    crossover: float = 300.0
    own: bool = False
    still: bool = False

    @property
    def backlash(self) -> dict[str, Any]:
        """Parameters of PairedTsmBacklash."""
        return {"c": self.c, "beta": self.B - self.c, "alpha": self.alpha}

    @property
    def compensator(self) -> dict[str, Any]:
        """Parameters of FeedforwardCompensator, Eqs (23), (25)."""
        return {**(self.backlash if self.own else mssp_feedforward.plant()), "law": 1}


def published(**values: Any) -> Completion:
    """The published set, plant and compensator alike."""
    p = mssp_feedforward.plant()
    return Completion(float(p["c"]), float(p["c"]) + float(p["beta"]), float(p["alpha"]), **values)


def system(completion: Completion, motion: str, compensated: bool) -> System:
    """The loop of FMUs."""
    loop = mssp_feedforward.loop(
        {model: FMUS[WITH_EFFECTS.get(model, model)] for model in mssp_feedforward.FMUS},
        motion,
        mssp_feedforward.MOTIONS[motion][0],
        position_loop(completion.crossover).gains,
        completion.backlash,
        completion.compensator if compensated else None,
    )
    values = {"controller.r.sensor_lag.tau": completion.lag, "error.u2.quantisation.q": COUNT, "motor.gear_ratio": GEAR}
    return loop.with_values({name: repr(value) for name, value in values.items()})


def _motor() -> Any:
    return kernel("DcMotor").params(values={"gear_ratio": GEAR})


@cache
def position_loop(crossover: float) -> PidDesign:
    """Gains of the PID on the motor with its gear."""
    return design_pid(_motor(), crossover=crossover, step=EXPERIMENT.step)


@cache
def linear_drive(crossover: float) -> Any:
    """Motor angle over the reference of the position loop (control.TransferFunction), without friction and limits."""
    delay = control.tf(*control.pade(EXPERIMENT.step / 2.0, 2))
    return control.feedback(controller_model(**position_loop(crossover).gains) * motor_model(_motor()) * delay, 1)


def cases(completion: Completion, experiment: Experiment = EXPERIMENT) -> dict[str, Case]:
    """Both motions, without and with compensator."""
    return {
        f"{motion}.{'law_1' if compensated else 'uncompensated'}": (system(completion, motion, compensated), experiment)
        for motion in MOTIONS
        for compensated in (False, True)
    }


def co_simulated(completions: Sequence[Completion], experiment: Experiment = EXPERIMENT) -> list[dict[str, float]]:
    """The eight numbers of each completion, from its four loops of FMUs."""
    jobs = {f"{k}.{name}": case for k, c in enumerate(completions) for name, case in cases(c, experiment).items()}
    runs = co_simulate(jobs, ["error.y"])
    found = []
    for k in range(len(completions)):
        own = {m: [runs[f"{k}.{m}.{v}"] for v in ("uncompensated", "law_1")] for m in MOTIONS}
        errors = {
            m: [np.degrees(r.columns["error.y"][experiment.window(r.time)]) for r in both] for m, both in own.items()
        }
        found.append(_numbers(errors))
    return found


def _numbers(errors: Mapping[str, Sequence[FloatArray]]) -> dict[str, float]:
    found: dict[str, float] = {}
    for motion, (without, with_law) in errors.items():
        values = (np.ptp(without), np.ptp(with_law), np.std(with_law), np.mean(with_law))
        found |= {f"{motion}.{n}": float(v) for n, v in zip(("width", "residual", "std", "mean"), values, strict=True)}
    return found


@cache
def _references(stop: float, step: float = 4e-3) -> tuple[FloatArray, dict[str, FloatArray]]:
    time: FloatArray = np.arange(round(stop / step) + 1, dtype=float) * step
    signal = kernel("ReferenceSignal")
    values = {m: signal.params(mssp_feedforward.MOTIONS[m][0]) for m in MOTIONS}
    return time, {m: signal.simulate(p, time, np.empty((time.size, 0)))[:, 0] for m, p in values.items()}


def ideal(completion: Completion, experiment: Experiment = EXPERIMENT) -> dict[str, float]:
    """The eight numbers with a linear drive."""
    time, references = _references(experiment.stop)
    plant, law = kernel("PairedTsmBacklash"), kernel("FeedforwardCompensator")
    p, q = plant.params("published", completion.backlash), law.params("published", completion.compensator)
    errors = {}
    for motion, x_r in references.items():
        commands = (x_r, law.simulate(q, time, x_r[:, None])[:, 0])
        moved = [_driven(_lagged(x, completion.lag, time[1]), completion.crossover, time[1]) for x in commands]
        outputs = [plant.simulate(p, time, x[:, None])[:, 0] for x in moved]
        errors[motion] = [np.degrees(x_r - y)[time >= experiment.evaluate_from] for y in outputs]
    return _numbers(errors)


def _lagged(x: FloatArray, tau: float, step: float) -> FloatArray:
    """First-order lag of a signal that starts at rest, straight between samples."""
    if tau < 1e-6:
        return x
    keep = math.exp(-step / tau)
    late = tau / step * (1.0 - keep)
    return np.asarray(lfilter([1.0 - late, late - keep], [1.0, -keep], x))


def _driven(x: FloatArray, crossover: float, step: float) -> FloatArray:
    """The motor's angle in a linear drive that starts at rest, straight between samples."""
    return x if math.isinf(crossover) else np.asarray(lfilter(*_sampled_drive(crossover, step), x))


@cache
def _sampled_drive(crossover: float, step: float) -> tuple[FloatArray, FloatArray]:
    sampled: Any = control.tf(control.sample_system(control.ss(linear_drive(crossover)), step, method="foh"))
    return sampled.num[0][0], sampled.den[0][0]


def deviations(numbers: Mapping[str, float], targets: Sequence[str] = NAMES) -> FloatArray:
    """Distance of each number from the middle of its print, over half the print: at most 1 is what is printed."""
    return np.array([(numbers[n] - TRACKED[n].span.middle) / (0.5 * TRACKED[n].span.width) for n in targets])


def worst(numbers: Mapping[str, float]) -> float:
    """Largest of `deviations`: all eight are met up to 1."""
    return float(np.abs(deviations(numbers)).max())


@dataclass(frozen=True)
class Fit:
    """The best set that was found, its numbers in co-simulation and with a linear drive, and how far off they are."""

    completion: Completion
    numbers: dict[str, float]
    ideal: dict[str, float]

    @property
    def worst(self) -> float:
        return worst(self.numbers)


def fitted(
    starts: Sequence[Completion],
    *,
    corrections: int = 5,
    population: int = 10,
    experiment: Experiment = EXPERIMENT,
) -> list[Fit]:
    """Fit c, B, alpha and lag to the eight numbers in co-simulation, for every start.

    Parameters
    ----------
    starts : sequence of Completion
        ``crossover``, ``own`` and ``still`` are kept, the others are searched in `SEARCHED`, globally.
    corrections : int
        At most so many rounds of co-simulation; only a set that comes near gets more than one.
    population : int
        Of the differential evolution, per value; its seed is fixed.
    experiment : Experiment
        Length and window of every run.
    """
    none = dict.fromkeys(NAMES, 0.0)
    places = side_by_side(_searched, [(start, none, population, experiment) for start in starts])
    at = {k: _at(start, x) for k, (start, x) in enumerate(zip(starts, places, strict=True))}
    best: dict[int, Fit] = {}
    for _ in range(corrections):
        for (k, completion), found in zip(at.items(), co_simulated(list(at.values()), experiment), strict=True):
            fit = Fit(completion, found, ideal(completion, experiment))
            if k not in best or fit.worst < best[k].worst:
                best[k] = fit
            at[k] = _at(completion, _refined(completion, _place(completion), _missed(fit), experiment))
        at = {k: completion for k, completion in at.items() if 1.0 < best[k].worst < NEAR}
        if not at:
            break
    return [best[k] for k in range(len(starts))]


NEAR = 3.0
"""Deviation from which on better corrections of the search do not help."""


def _missed(fit: Fit) -> dict[str, float]:
    return {n: fit.numbers[n] - fit.ideal[n] for n in NAMES}


def _place(completion: Completion) -> list[float]:
    return [getattr(completion, name) for name in SEARCHED]


def _at(start: Completion, x: Sequence[float]) -> Completion:
    values = dict(zip(SEARCHED, map(float, np.clip(x, *np.transpose(list(SEARCHED.values())))), strict=True))
    return replace(start, **(values | ({"lag": 0.0} if start.still else {})))


def _cost(x: Sequence[float], start: Completion, offset: Mapping[str, float], experiment: Experiment) -> float:
    """A smooth largest deviation."""
    completion = _at(start, x)
    if completion.B >= completion.c:
        return 1e3
    without = ideal(completion, experiment)
    off = deviations({n: without[n] + offset[n] for n in NAMES})
    return float(np.sum(off**16) ** (1.0 / 16.0))


def _searched(
    start: Completion, offset: Mapping[str, float], population: int, experiment: Experiment
) -> Sequence[float]:
    found: Any = differential_evolution(
        _cost,
        list(SEARCHED.values()),
        args=(start, offset, experiment),
        rng=np.random.default_rng(1),
        maxiter=40,
        popsize=population,
        polish=False,
    )
    return _refined(start, found.x, offset, experiment)


def _refined(
    start: Completion, x: Sequence[float], offset: Mapping[str, float], experiment: Experiment
) -> Sequence[float]:
    for _ in range(3):  # a simplex that has collapsed at a corner of the largest deviation starts anew
        found: Any = minimize(
            _cost,
            x,
            args=(start, offset, experiment),
            method="Nelder-Mead",
            options={"maxfev": 250, "xatol": 1e-6, "fatol": 1e-5},
        )
        x = found.x
    return list(x)


MAP: dict[str, tuple[float, ...]] = {
    "crossover": BANDWIDTHS,
    "lag": (0.0, 0.01, 0.02, 0.03, 0.04),
    "B": (0.1, 0.3, 0.5, 0.7, 0.85),
    "alpha": (3.0, 4.5, 6.0, 8.0, 10.1),
}
"""What each unknown does, one at a time about a fitted set: bandwidth [rad/s], lag [s], B, alpha [1/rad]."""


Line = list[tuple[float, dict[str, float]]]
"""Values of one unknown, and the eight numbers at each."""


def mapped(lines: Sequence[tuple[Completion, str, Sequence[float]]], experiment: Experiment = EXPERIMENT) -> list[Line]:
    """The eight numbers along each unknown (completion about which, its name, values), all in co-simulation."""
    points = [replace(about, **{name: value}) for about, name, values in lines for value in values]
    numbers = iter(co_simulated(points, experiment))
    return [[(value, next(numbers)) for value in values] for _, _, values in lines]


def described(completion: Completion) -> str:
    """The set in words."""
    return (
        f"c = {completion.c:.4f}, B = {completion.B:.3f}, alpha = {completion.alpha:.2f} 1/rad, "
        f"lag {1e3 * completion.lag:.1f} ms, position loop of {completion.crossover:.0f} rad/s"
    )
