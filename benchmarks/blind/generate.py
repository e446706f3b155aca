"""Cases as files: logs and `case.json` in a folder each, the truth of all in one file beside these folders."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from .catalogue import NEEDS, Case
from .hidden import FORMS, rms
from .instruments import coloured, sampling, stepped
from .motions import FloatArray, Motion, motion
from .outside import OUTSIDE
from .plants import RUNS, Change, Rig, Signals, channels, draw_rig, signals

SAMPLE = 0.005
"""Sample period of the logs [s]."""
FINER = 8
"""Steps of the plant per sample."""
ACCURACY = 0.005
"""Relative error left of a stated size."""
NEAREST = 0.05
"""The same where the response jumps with the amount."""
VISIBLE_STEP = 3e-4
"""Encoder step over the stroke from which on a log shows it: naming it is no error then."""


@dataclass(frozen=True)
class Made:
    """A case before it is written.

    Attributes
    ----------
    case : Case
    rig : Rig
    values : dict of str to float
        Parameters that the user has.
    amounts : tuple of float
        Of each hidden effect, at which its response has the stated size.
    runs : dict of str to pandas.DataFrame
        Logs by file name.
    noise : dict of str to float
        RMS of what the instruments add to each channel on the measured runs.
    response : dict of str to float
        RMS change of each channel by all that is hidden, on the measured runs.
    scale : dict of str to float
        RMS of each channel on the measured runs.
    """

    case: Case
    rig: Rig
    values: dict[str, float]
    amounts: tuple[float, ...]
    runs: dict[str, pd.DataFrame]
    noise: dict[str, float]
    response: dict[str, float]
    scale: dict[str, float]


def changes_of(case: Case) -> list[Change]:
    """What the case hides."""
    return [FORMS[name][1] if name in FORMS else OUTSIDE[name] for name in case.hidden]


def effects_of(case: Case) -> list[str]:
    """Ids of what the case hides; empty outside the vocabulary."""
    return [FORMS[name][0] for name in case.hidden if name in FORMS]


def make(case: Case) -> Made:
    """Simulate a case."""
    rng = np.random.default_rng(case.seed)
    rig = draw_rig(case.model, rng, turns=case.turns, dip=case.dip, held=case.held)
    measured = [_moved(case, rig, kind, 10 + k) for k, kind in enumerate(case.measured)]
    exciting = _exciting(case, rig) if case.stratum == "G" else measured
    amounts = tuple(_sized(exciting, change, case.size) for change in changes_of(case))
    values = rig.parameters()
    if case.wrong:
        values = _wrong(case, rig, measured)
    values = {name: float(f"{value:.5g}") for name, value in values.items()}
    logs, noises, responses, scales = {}, [], [], []
    motions = {f"measured_{k + 1}": s for k, s in enumerate(measured)}
    motions |= {f"holdout_{k + 1}": _moved(case, rig, kind, 30 + k) for k, kind in enumerate(case.holdout)}
    for k, (name, clean) in enumerate(motions.items()):
        dirty = _changed(clean, zip(changes_of(case), amounts, strict=True))
        log, error = _logged(case, dirty, np.random.default_rng([case.seed, k]))
        logs[f"{name}.csv"] = log
        if name.startswith("measured"):
            before, after = channels(clean), _read(dirty)
            noises.append(error)
            responses.append({c: rms(after[c] - before[c]) for c in before})
            scales.append({c: rms(before[c]) for c in before})
    if case.reference:
        for k, kind in enumerate(("strokes", "chirp")):
            clean = _moved(case, rig, kind, 50 + k)
            logs[f"reference_{k + 1}.csv"] = _logged(case, clean, np.random.default_rng([case.seed, 90 + k]))[0]
    return Made(case, rig, values, amounts, logs, _pooled(noises), _pooled(responses), _pooled(scales))


def write(cases: Iterable[Case], out: Path) -> dict[str, dict[str, object]]:
    """Write ``out/logs/CASE/...`` and ``out/answers.json``; return the answers."""
    answers: dict[str, dict[str, object]] = {}
    for case in cases:
        made, folder = make(case), out / "logs" / case.name
        folder.mkdir(parents=True, exist_ok=True)
        for name, log in made.runs.items():
            log.to_csv(folder / name, index=False, float_format="%.8g", lineterminator="\n")
        known = {
            "model": case.model,
            "set": made.values,
            **{
                role: sorted(n for n in made.runs if n.startswith(role))
                for role in ("measured", "holdout", "reference")
            },
            "options": [],
        }
        (folder / "case.json").write_text(json.dumps(known, indent=2) + "\n")
        answers[case.name] = answer(made)
    (out / "answers.json").write_text(json.dumps(answers, indent=2) + "\n")
    return answers


def answer(made: Made) -> dict[str, object]:
    """The truth of a case, for the scorer."""
    case = made.case
    steps_show = case.instruments.encoder > VISIBLE_STEP
    return {
        "stratum": case.stratum, "model": case.model, "hidden": list(case.hidden), "effects": effects_of(case),
        "tolerated": ["quantisation"] if steps_show else [], "size": case.size, "amounts": list(made.amounts),
        "wrong": list(case.wrong), "true": made.rig.parameters(), "noise": made.noise, "response": made.response,
        "scale": made.scale,
    }  # fmt: skip


def unmodelled(made: Made) -> dict[str, float]:
    """RMS of the hidden response that the baseline's parameters cannot take up, by channel, on the measured runs.

    They can shift and scale each part of the channel: position, load, direction state and speed.
    """
    left: dict[str, list[FloatArray]] = {}
    for k, kind in enumerate(made.case.measured):
        clean = _moved(made.case, made.rig, kind, 10 + k)
        before, after = channels(clean), _read(_changed(clean, zip(changes_of(made.case), made.amounts, strict=True)))
        for c in before:
            parts = [np.ones(clean.t.size), clean.x] if c == "x_out" else [clean.z, clean.v, clean.load]
            if c == "x_out":
                parts.append(before[c])
            basis, change = np.column_stack(parts), after[c] - before[c]
            left.setdefault(c, []).append(change - basis @ np.linalg.lstsq(basis, change, rcond=None)[0])
    return {c: rms(np.concatenate(parts)) for c, parts in left.items()}


# -- signals


def _moved(case: Case, rig: Rig, kind: str, number: int) -> Signals:
    m = motion(kind, case.duration, SAMPLE / FINER, case.pace, np.random.default_rng([case.seed, number]))
    m = Motion(m.t, *(case.scale * y for y in (m.x, m.v, m.a)))
    return signals(rig, m, RUNS * case.seed + number)


def _exciting(case: Case, rig: Rig) -> list[Signals]:
    """The motion on which a G case has its stated size."""
    rich = replace(case, pace=1.0, scale=1.0, duration=20.0, measured=("sines", "chirp"))
    rich = replace(rich, **{k: v for k, v in NEEDS.get(case.hidden[0], {}).items() if k in ("measured", "pace")})  # pyright: ignore[reportArgumentType]
    return [_moved(rich, replace(rig, held=False), kind, 70 + k) for k, kind in enumerate(rich.measured)]


def _changed(clean: Signals, changes: Iterable[tuple[Change, float]]) -> Signals:
    s = replace(clean, friction=clean.friction.copy(), x_out=clean.x_out.copy(), levels={})
    for change, amount in changes:
        change(s, amount)
    return s


def _read(s: Signals) -> dict[str, FloatArray]:
    return {c: stepped(y, s.levels.get(c, 0.0), truncate=True) for c, y in channels(s).items()}


def _ratio(runs: list[Signals], others: list[Signals]) -> float:
    """RMS difference over the RMS, of the channel where it is largest."""
    before, after = [channels(s) for s in runs], [_read(s) for s in others]
    parts = []
    for c in before[0]:
        change = np.concatenate([a[c] - b[c] for a, b in zip(after, before, strict=True)])
        parts.append(rms(change) / rms(np.concatenate([b[c] for b in before])))
    return max(parts)


def _scaled_to(size: float, first: float, ratio_at: Callable[[float], float]) -> float:
    """Amount at which the ratio has the size; a coarse converter's ratio jumps, so the nearest of many has to do."""
    amount, best = first, (np.inf, first)
    for k in range(40):
        found = ratio_at(amount)
        best = min(best, (abs(found / size - 1.0), amount))
        if best[0] <= ACCURACY:
            return best[1]
        change = float(np.clip(size / found, 0.2, 5.0)) if found > 0.0 else 5.0
        amount *= change if k < 8 else change ** (0.9 / (k - 6))
    if best[0] > NEAREST:
        raise RuntimeError(f"size {size} not reached: {100.0 * best[0]:.1f} % off at {best[1]}")
    return best[1]


def _sized(runs: list[Signals], change: Change, size: float) -> float:
    return _scaled_to(size, 0.05, lambda amount: _ratio(runs, [_changed(s, [(change, amount)]) for s in runs]))


def _wrong(case: Case, rig: Rig, runs: list[Signals]) -> dict[str, float]:
    """The parameters, some of them off in different directions, so that the rig they describe differs by the size."""
    true = rig.parameters()

    def values(amount: float) -> dict[str, float]:
        together = {"tau_s": "tau_c", "F_s": "F_c"} if len(case.wrong) > 1 else {}
        off = {n: (-1.0 if k % 2 else 1.0) for k, n in enumerate(case.wrong) if n not in together}
        off |= {n: off[together[n]] for n in case.wrong if n in together and together[n] in off}
        return {**true, **{n: true[n] * float(np.exp(sign * amount)) for n, sign in off.items()}}

    def ratio_at(amount: float) -> float:
        other = rig.with_parameters(values(amount))
        return _ratio(runs, [_moved(case, other, kind, 10 + k) for k, kind in enumerate(case.measured)])

    return values(_scaled_to(case.size, 0.05, ratio_at))


# -- instruments


def _logged(case: Case, s: Signals, rng: np.random.Generator) -> tuple[pd.DataFrame, dict[str, float]]:
    """The log, and the RMS of what the instruments added to each channel."""
    how, rig = case.instruments, s.rig
    true, stamps = sampling(s.t.size, FINER, s.step, how, rng)

    def seen(y: FloatArray) -> FloatArray:
        return np.interp(true, s.t, y)

    def noisy(y: FloatArray, share: float) -> FloatArray:
        return seen(y) + share * rms(y) * coloured(true.size, how.colour, rng)

    lines = how.encoder * rig.stroke * case.scale
    measured: dict[str, FloatArray] = {}
    for c, y in channels(s).items():
        quiet = 0.1 if c in s.levels else 1.0
        with_noise = noisy(y, quiet * how.noise * (0.2 if c == "x_out" else 1.0))
        measured[c] = stepped(with_noise, s.levels.get(c, lines if c == "x_out" else 0.0), truncate=c in s.levels)
    columns = {"time [s]": stamps}
    if rig.model in ("TendonDrive", "PairedTsmBacklash"):
        angle = ("deg", np.degrees) if rig.model == "PairedTsmBacklash" else ("rad", np.asarray)
        columns[f"x_in [{angle[0]}]"] = angle[1](stepped(seen(s.x), lines))
        columns[f"x_out [{angle[0]}]"] = angle[1](measured["x_out"])
        if rig.model == "TendonDrive":
            columns |= {"tau_out [N*m]": noisy(s.load, 0.2 * how.noise), "tau_in [N*m]": measured["tau_in"]}
    else:
        place = stepped(seen(s.x), lines)  # a drive reports the mean speed over its cycle
        columns["v [mm/s]"] = 1e3 * np.diff(place, prepend=place[0]) / np.diff(stamps, prepend=stamps[0] - SAMPLE)
        if rig.model == "SingleTsmDahl":
            far = noisy(s.load, 0.05 * how.noise)
            columns |= {
                "a [mm/s2]": 1e3 * noisy(s.a, 0.5 * how.noise),
                "T_in [N]": far + measured["F"],
                "T_load [N]": far,
            }
        columns["F [N]"] = measured["F"]
    even = np.arange(true.size) * SAMPLE
    fair = {c: np.interp(even, s.t, _read(s)[c]) for c in measured}
    return pd.DataFrame(columns), {c: rms(measured[c] - fair[c]) for c in measured}


def _pooled(runs: list[dict[str, float]]) -> dict[str, float]:
    return {c: float(np.sqrt(np.mean([r[c] ** 2 for r in runs]))) for c in runs[0]}
