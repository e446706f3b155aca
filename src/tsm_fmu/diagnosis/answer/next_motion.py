"""The next experiment: the motion out of a menu that best separates rivals that this log cannot tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from scipy.signal import chirp, sawtooth

from ...kernels.arrays import FloatArray
from ...kernels.kernel import kernel
from ...models.contract import InputError
from ..evidence import NextMotion
from ..fits.refit import Fitted
from ..fits.response import places_of

STEP = 0.005
LENGTH = 20.0
ROUNDED = 0.1
"""Time over which a corner of the motion is rounded [s]."""


def next_motion(rivals: Sequence[Fitted], floor: FloatArray) -> NextMotion | None:
    """The motion of the menu whose least separated pair of rivals differs most; None with fewer than two rivals.

    Parameters
    ----------
    rivals : sequence of Fitted
        Refitted with each of the effects that cannot be told apart.
    floor : ndarray, shape (channels,)
    """
    if len(rivals) < 2:
        return None
    best: NextMotion | None = None
    variables = rivals[0].problem.kernel.inputs
    for name, time, inputs in menu(rivals[0]):
        try:
            predicted = [_outputs(r, time, inputs) for r in rivals]
        except InputError:
            continue
        differences = [
            float(np.max(np.sqrt(np.mean((a - b - (a - b).mean(axis=0)) ** 2, axis=0)) / floor))
            for a, b in combinations(predicted, 2)
        ]
        if best is None or min(differences) > best.separation:
            columns = {v.name: inputs[:, j] for j, v in enumerate(variables)}
            best = NextMotion(name, time, columns, {v.name: v.quantity.unit for v in variables}, min(differences))
    return best


def menu(fitted: Fitted) -> list[tuple[str, FloatArray, FloatArray]]:
    """Motions within the range of position, speed, load and sheath angle of the measured runs: name, time, inputs."""
    problem, places = fitted.problem, places_of(fitted)
    x = np.concatenate([p.x for p in places])
    centre, half = 0.5 * float(x.max() + x.min()), 0.5 * float(np.ptp(x)) or 1.0
    fastest = float(np.quantile(np.abs(np.concatenate([p.v for p in places])), 0.99)) or 1.0
    top = fastest / (2.0 * np.pi * half)  # frequency at which a full sine reaches that speed
    t = np.arange(0.0, LENGTH, STEP)
    ramp = sawtooth(2.0 * np.pi * 0.5 * top * t, 0.5)  # pyright: ignore[reportArgumentType]
    shapes = {
        "one full stroke, sine at the highest speed": np.sin(2.0 * np.pi * top * t),
        "one full stroke, sine at a tenth of the highest speed": np.sin(2.0 * np.pi * 0.1 * top * t),
        "sweep from a tenth of the highest speed to it": chirp(t, 0.1 * top, t[-1], top, phi=-90),
        "half strokes about both ends": 0.5 * np.sin(2.0 * np.pi * top * t) + 0.5 * np.sign(np.sin(0.2 * np.pi * t)),
        "strokes of growing size, nested reversals": (t / t[-1]) * np.sin(2.0 * np.pi * top * t),
        "slide, hold for growing times, slide": _slide_and_hold(t, ramp),
        "ramps there and back, constant speed": ramp,
        "two sines": 0.7 * np.sin(2 * np.pi * 0.4 * top * t) + 0.3 * np.sin(2 * np.pi * 1.33 * top * t),
    }
    model = kernel(problem.kernel.name)
    motion, load = model.motion, model.roles.load
    names = [v.name for v in problem.kernel.inputs]
    drives = fitted.task.drives
    loads = [("load", load), *((d.column, d.column) for d in drives if d.role == "load")]
    loads += [("sheath angle", d.column) for d in drives if d.role == "bend"]
    loads += [(d.column, d.column) for d in drives if d.role == "temperature"]
    secondary = {word: names.index(n) for word, n in loads if n in names}
    places_as = [motion, *(d.column for d in drives if d.role == "position")]
    found = []
    for name, shape in shapes.items():
        for swept in ("", *secondary):
            inputs = np.tile(np.mean([r.inputs.mean(axis=0) for r in problem.runs], axis=0), (t.size, 1))
            position = playable(centre + half * np.clip(shape, -1.0, 1.0), t, fastest)
            for channel in places_as:
                _put(inputs, names, channel, position, t)
            if swept:
                column = secondary[swept]
                values = np.concatenate([r.inputs[:, column] for r in problem.runs])
                middle, width = 0.5 * (values.max() + values.min()), 0.5 * np.ptp(values)
                inputs[:, column] = middle + (width or 0.5 * abs(middle)) * np.sin(2.0 * np.pi * 0.13 * t)
            label = ", ".join([name, *(f"{word} {'swept' if word == swept else 'constant'}" for word in secondary)])
            found.append((label, t, np.ascontiguousarray(inputs)))
    return found


def playable(position: FloatArray, t: FloatArray, fastest: float) -> FloatArray:
    """The motion at no more than a speed, its corners rounded over a tenth of a second."""
    dt, followed = float(t[1] - t[0]), np.empty_like(position)
    followed[0] = position[0]
    for k in range(1, position.size):
        followed[k] = followed[k - 1] + min(max(position[k] - followed[k - 1], -fastest * dt), fastest * dt)
    width = max(1, round(ROUNDED / dt))
    padded = np.pad(followed, (width // 2, width - 1 - width // 2), mode="edge")
    return np.convolve(padded, np.full(width, 1.0 / width), "valid")


def _outputs(fitted: Fitted, time: FloatArray, inputs: FloatArray) -> FloatArray:
    problem = fitted.problem
    return problem.kernel.simulate(problem.params(fitted.table[0]), time, inputs)[:, problem.columns]


def _put(inputs: FloatArray, names: list[str], motion: str, position: FloatArray, t: FloatArray) -> None:
    v = np.gradient(position, t)
    for name, values in ((motion, v if motion == "v" else position), ("v", v), ("a", np.gradient(v, t))):
        if name in names:
            inputs[:, names.index(name)] = values


def _slide_and_hold(t: FloatArray, ramp: FloatArray) -> FloatArray:
    """The ramp, stopped for 0.5, 1, 2 and 4 s."""
    moving = np.ones(t.size)
    for begin, hold in ((2.0, 0.5), (5.0, 1.0), (9.0, 2.0), (14.0, 4.0)):
        moving[(t >= begin) & (t < begin + hold)] = 0.0
    clock = np.cumsum(moving) * (t[1] - t[0])
    return np.interp(clock, t, ramp)
