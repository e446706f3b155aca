"""Functions that residuals are compared with: independent of every unit, and what their texts say."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from tsm_fmu.diagnosis.residual import families
from tsm_fmu.diagnosis.residual.frequency import _bands
from tsm_fmu.diagnosis.residual.library import (
    _after_reversals,
    _directions,
    _lags,
    _loads,
    _local,
    _over_speed,
    _polynomials,
    _rests,
    _Runs,
    _times,
    _turning,
    folds,
)
from tsm_fmu.diagnosis.runs.motion_signals import Coordinates

DT = 0.0107


def made(seed: int = 4, count: int = 3, load: bool = True, level: float = 0.7) -> list[Coordinates]:
    """Coordinates of about unit size that are consistent with no motion: each function of them is by itself."""
    rng, found = np.random.default_rng(seed), []
    for k in range(count):
        n = 160 + 30 * k
        smooth = [np.convolve(rng.normal(size=n + 20), np.hanning(21), "valid")[:n] for _ in range(6)]
        x, v, a, z, measured, other = (0.4 * y for y in smooth)
        since = np.abs(np.cumsum(np.abs(x)) % 1.3)
        dwell = np.repeat(rng.uniform(0.0, 0.9, 8), n // 8 + 1)[:n]
        driven = np.column_stack([measured + 2.0, other]) if load else np.empty((0, 0))
        found.append(
            Coordinates(
                x + level,
                v,
                a,
                np.where(v >= 0.0, 1.0, -1.0),
                np.tanh(3.0 * z),
                np.full(n, 0.01),
                since,
                dwell,
                measured + 2.0 if load else None,
                5.0 + DT * np.arange(n),
                driven,
            )
        )
    return found


def in_other_units(c: Coordinates, length: float, seconds: float, force: float) -> Coordinates:
    return replace(
        c,
        x=length * c.x,
        v=length / seconds * c.v,
        a=length / seconds**2 * c.a,
        x_pre=length * c.x_pre,
        since_reversal=length * c.since_reversal,
        time=seconds * c.time,
        load=None if c.load is None else force * c.load,
        driven=force * c.driven,
    )


@pytest.mark.parametrize(
    ("length", "seconds", "force", "output"),
    [
        (1e-3, 1.0, 1.0, 1.0),
        (57.3, 1.0, 1.0, 1.0),
        (1.0, 40.0, 1.0, 1.0),
        (1.0, 1.0, 1e3, 1.0),
        (1.0, 1.0, 1.0, 1e-4),
        (0.31, 0.05, 0.02, 70.0),
    ],
)
@pytest.mark.parametrize("load", [True, False])
def test_functions_of_a_family_are_the_same_in_any_unit(length, seconds, force, output, load) -> None:
    """But for a rest, whose length is told in tenths of a second: it keeps its unit here."""
    where = made(load=load)
    outputs = [3.0 + np.sin(np.arange(c.x.size)) for c in where]
    scaled = [in_other_units(c, length, seconds, force) for c in where]
    found = families.Functions(where, 1).of_all(outputs)
    other = families.Functions(scaled, 1).of_all([output * y for y in outputs])
    assert (
        list(found)
        == list(other)
        == [
            f
            for f in ("position", "speed", "acceleration", "load", "time", "history", "direction", "sensor")
            if load or f != "load"
        ]
    )
    for family, columns in found.items():
        assert columns.shape == (sum(c.x.size for c in where), columns.shape[1])
        assert other[family] == pytest.approx(columns, rel=1e-9, abs=1e-9), family
        assert np.isfinite(columns).all()


@pytest.mark.parametrize("step", [3, 7])
def test_at_fewer_samples_functions_are_those_of_all_of_them(step: int) -> None:
    where = made()
    outputs = [3.0 + np.sin(np.arange(c.x.size)) for c in where]
    every, few = (families.Functions(where, n) for n in (1, step))
    kept = np.concatenate([np.arange(c.x.size) % step == 0 for c in where])
    assert np.array_equal(few.common, every.common[kept])
    for family, columns in few.of_all(outputs).items():
        assert np.array_equal(columns, every.of_all(outputs)[family][kept]), family


@pytest.mark.parametrize("family", ["speed", "acceleration", "time", "history", "direction", "position"])
def test_functions_change_sense_with_the_motion_or_stay(family: str) -> None:
    """x, v, a, s, z of the other sign: each function is the same, or of the other sign, or one of its family."""
    where = made(load=False, level=0.0)
    turned = [replace(c, x=-c.x, v=-c.v, a=-c.a, s=-c.s, z=-c.z) for c in where]
    outputs = [np.sin(np.arange(c.x.size)) for c in where]
    columns, other = (families.Functions(p, 1).of_all(outputs)[family] for p in (where, turned))
    basis = np.linalg.qr(np.column_stack([columns, np.ones(len(columns))]))[0]
    left = other - basis @ (basis.T @ other)
    assert np.linalg.norm(left, axis=0).max() < 1e-6 * np.linalg.norm(other, axis=0).max()


def test_a_position_is_anything_over_the_stroke_and_a_speed_any_of_these_laws() -> None:
    """What a family holds, each law as papers write it: the regression finds it among the functions, exactly."""
    where = made()
    outputs = [np.sin(np.arange(c.x.size)) for c in where]
    found = families.Functions(where, 1).of_all(outputs)
    x, v, a, z, s = (np.concatenate([getattr(c, n) for c in where]) for n in ("x", "v", "a", "z", "s"))
    time = np.concatenate([c.time - c.time[0] for c in where])
    load = np.concatenate([c.load for c in where if c.load is not None])
    length = max(float(np.ptp(c.time)) for c in where)
    rms = float(np.sqrt(np.mean(v**2)))
    low, span = x.min(), np.ptp(x)
    stroke = max(float(np.ptp(c.x)) for c in where)
    since = np.concatenate([c.since_reversal for c in where])
    after = np.log(np.clip(since, 0.002 * stroke, 0.7 * stroke) / (0.002 * stroke)) / np.log(0.7 / 0.002)
    rested = np.log1p(np.concatenate([c.dwell for c in where]) / 0.1)
    y = np.concatenate(outputs)
    knot = low + 5.0 / 13.0 * span
    laws = {
        "position": [
            x,
            np.abs(x - knot),
            z * x,
            z * np.abs(x - knot),
            (x - low - 0.5 * span) * v,
            (x - low - 0.5 * span) ** 2 * v,
        ],
        "speed": [
            v,
            v * np.abs(v),
            v**3,
            z * np.abs(v),
            z * v**2,
            s * np.sqrt(np.abs(v)),
            z * np.exp(-np.abs(v) / (0.2 * rms)),
            z * np.exp(-((v / (0.4 * rms)) ** 2)),
            np.arcsinh(v / (0.1 * rms)),
            np.arcsinh(v / (0.025 * rms)),
        ],
        "acceleration": [a, np.abs(a), a**3, z * np.abs(a), z * (a * v > 0), a * (v > 0), z * np.abs(a) * (a * v > 0)],
        "load": [
            load,
            load**2,
            np.abs(load),
            z * load,
            z * np.abs(load),
            z * load**2,
            z * np.sqrt(np.abs(load)),
            np.abs(load) * v,
            load * (x - low),
            z * np.maximum(0.0, np.abs(load) - 0.5 * np.abs(load).max()),
            z * np.abs(load) * (load * v > 0),
        ],
        "time": [
            time,
            time**2,
            np.exp(-time / (0.1 * length)),
            np.exp(-time / (0.3 * length)),
            z * time,
            z * np.exp(-time / (0.1 * length)),
            v * np.exp(-time / (0.3 * length)),
            v * np.exp(-time / (0.1 * length)),
        ],
        "history": [s * after, s * np.abs(after - 6.0 / 13.0), z * rested],
        "direction": [v > 0, np.abs(v), v**2, np.abs(z), np.maximum(v, 0.0), (v > 0) * np.sqrt(np.abs(v))],
        "sensor": [y - y.mean()],
    }

    def late(name: str, seconds: float, of: Callable[[np.ndarray], np.ndarray] = lambda y: y) -> np.ndarray:
        return np.concatenate([families._lag(of(getattr(c, name)), c, seconds) for c in where])

    def rate(name: str) -> np.ndarray:
        return np.concatenate([np.gradient(getattr(c, name), c.time) for c in where])

    def aged() -> np.ndarray:
        found = []
        for c in where:
            age = 0.0
            for dt, dx in zip(np.diff(c.time, prepend=c.time[0]), np.diff(c.x, prepend=c.x[0]), strict=True):
                worn = abs(dx) / (0.05 * stroke)
                age = age * np.exp(-worn) + (dt * (1.0 - np.exp(-worn)) / worn if worn else dt)
                found.append(np.log1p(age / (0.3 * pace)))
        return np.array(found)

    pace, big = span / rms, np.abs(load).max()
    top = float(np.sqrt(np.mean(a**2)))
    way = np.concatenate([np.cumsum(np.abs(np.diff(c.x, prepend=c.x[0]))) for c in where])
    travel = max(float(np.sum(np.abs(np.diff(c.x)))) for c in where)
    laws["acceleration"] += [rate("a"), np.tanh(a / (0.3 * top)), late("a", 0.05 * pace), late("a", 0.2 * pace)]
    laws["acceleration"] += [z * np.abs(np.tanh(a / (0.3 * top))) * (a * v > 0), np.tanh(a / (0.3 * top)) * (v > 0)]
    laws["load"] += [np.tanh(10 * load / big), np.tanh(30 * load / big), late("load", 0.1 * length, np.square)]
    laws["load"] += [late("load", part * length) for part in (0.003, 0.01, 0.03, 0.1)]
    laws["load"] += [z * np.abs(load) * np.tanh(10 * load / big * v / rms)]
    for part in (0.1, 0.3):  # friction warms, and its law with it
        warm = late("v", part * length, lambda y: np.abs(y) / (np.abs(y) + 0.1 * rms))
        laws["time"] += [warm, z * warm]
    laws["time"] += [way, np.exp(-way / (0.1 * travel)), z * np.exp(-way / (0.4 * travel))]
    laws["history"] += [x - late("x", part * length) for part in (0.003, 0.01, 0.03, 0.1)]
    laws["history"] += [s - late("s", part * length) for part in (0.003, 0.01, 0.03, 0.1)]
    laws["history"] += [z * (np.abs(v) - late("v", part * pace, np.abs)) for part in (0.01, 0.05, 0.2)]
    laws["history"] += [s * rested * np.maximum(0.0, 1.0 - np.abs(13.0 * after - 8.0)), z * aged()]
    slope = np.concatenate([np.gradient(o, c.time) for o, c in zip(outputs, where, strict=True)])
    bend = np.concatenate([np.gradient(np.gradient(o, c.time), c.time) for o, c in zip(outputs, where, strict=True)])
    laws["sensor"] += [slope, bend, slope * time]
    for family, several in laws.items():
        columns = found[family] / np.maximum(np.linalg.norm(found[family], axis=0), 1e-300)  # some places have none
        for k, law in enumerate(several):
            one = np.asarray(law, float)
            weights = np.linalg.lstsq(columns, one, rcond=None)[0]
            assert np.linalg.norm(one - columns @ weights) < 1e-6 * np.linalg.norm(one), (family, k)


def test_a_lag_follows_a_step_as_its_time_constant_says_and_rests_at_first() -> None:
    (c, *_) = made()
    step = np.where(np.arange(c.x.size) >= 20, 1.0, 0.25)
    slow = families._lag(step, c, 0.3)
    after = np.maximum(0.0, DT * (np.arange(c.x.size) - 19.0))
    assert slow == pytest.approx(0.25 + 0.75 * (1.0 - np.exp(-after / 0.3)), rel=1e-9)


def evaluated(text: str, c: Coordinates, middle: float) -> np.ndarray:
    """A text of the library as arithmetic, by a reader of its own."""
    parts: dict[str, np.ndarray] = {
        "sgn(v)": c.s,
        "sgn(a)": np.sign(c.a),
        "|v|": np.abs(c.v),
        "|a|": np.abs(c.a),
        "sqrt(|v|)": np.sqrt(np.abs(c.v)),
        "v": c.v,
        "a": c.a,
        "t": c.time - c.time[0],
        "X": c.x - middle,
        "X^2": (c.x - middle) ** 2,
        "X^3": (c.x - middle) ** 3,
    }
    if c.load is not None:
        parts |= {"L": c.load, "|L|": np.abs(c.load), "L^2": c.load**2}
    value = np.ones(c.x.size)
    for word in text.split():
        value = value * parts[word]
    return value


@pytest.mark.parametrize(("level", "shown"), [(0.0, "x"), (0.7, "(x - "), (-3.1, "(x + ")])
def test_plain_terms_are_what_their_texts_say(level: float, shown: str) -> None:
    where = made(level=level)
    if not level:
        mean = np.mean(np.concatenate([c.x for c in where]))
        where = [replace(c, x=c.x - mean) for c in where]
    runs = _Runs(where, "rad", "N")
    middle = float(np.mean(np.concatenate([c.x for c in where]))) if level else 0.0
    assert runs.x_text.startswith(shown)
    if level:
        assert f"{abs(math.degrees(middle)):.3g}"[:4] in runs.x_text
    groups: list[Callable] = [_polynomials, _directions, _loads]
    terms = [t for group in groups for t in group(runs)] + _times(runs)[:3]
    assert len({t.text for t in terms}) == len(terms) == 28
    for term in terms:
        text = term.text.replace(runs.x_text, "X")
        for c, values in zip(where, term.values, strict=True):
            assert values == pytest.approx(evaluated(text, c, middle), rel=1e-12), term.text
    units = {t.text.replace(runs.x_text, "X"): t.unit for t in terms}
    assert (units["X^2"], units["v |v|"], units["a"], units["sgn(v) |L|"], units["X L"]) == (
        "rad2",
        "(rad/s)2",
        "rad/s2",
        "N",
        "rad.N",
    )


def test_decays_and_places_are_parts_of_stroke_speed_and_run() -> None:
    where = made()
    runs = _Runs(where, "m", "N")
    span, length = max(np.ptp(c.x) for c in where), max(np.ptp(c.time) for c in where)
    rms = float(np.sqrt(np.mean(np.concatenate([c.v for c in where]) ** 2)))
    for group, parts, of in (
        (
            _after_reversals,
            (0.005, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32),
            lambda c, q: np.exp(-c.since_reversal / (q * span)),
        ),
        (_over_speed, (0.05, 0.1, 0.2, 0.4, 0.8), lambda c, q: np.exp(-np.abs(c.v) / (q * rms))),
    ):
        terms = group(runs)
        assert len(terms) == len(parts)
        for term, part in zip(terms, parts, strict=True):
            for c, values in zip(where, term.values, strict=True):
                assert values == pytest.approx(c.s * of(c, part), rel=1e-12)
    late = _times(runs)[3]
    for c, values in zip(where, late.values, strict=True):
        assert values == pytest.approx(c.s * np.exp(-(c.time - c.time[0]) / (0.2 * length)), rel=1e-12)
    assert late.text == f"sgn(v) exp(-t/{0.2 * length:.2g} s)"
    local = _local(runs)
    low = min(c.x.min() for c in where)
    centres = [(w, low + 0.5 * w * span + k * w * span) for w in (0.12, 0.06) for k in range(math.ceil(1 / w - 0.5))]
    assert len(local) == 2 * len(centres)
    assert all(t.local for t in local)
    for (wide, centre), plain, signed in zip(centres, local[::2], local[1::2], strict=True):
        for c, one, other in zip(where, plain.values, signed.values, strict=True):
            near = np.exp(-(((c.x - centre) / (wide * span)) ** 2))
            assert one == pytest.approx(near, abs=1e-12)
            assert other == pytest.approx(c.s * near, abs=1e-12)
    rest = _rests(runs)
    for c, values in zip(where, rest[0].values, strict=True):
        assert values == pytest.approx(c.s * np.exp(-c.since_reversal / (0.05 * span)) * np.log(1.0 + c.dwell))
    short = [replace(c, dwell=c.dwell / np.ptp(c.dwell) * 0.0099 * length) for c in where]
    assert _rests(_Runs(short, "m", "N")) == []
    lags = _lags(runs)
    assert len(lags) == 8
    for k, part in enumerate((0.003, 0.01, 0.03, 0.1)):
        for c, values in zip(where, lags[2 * k + 1].values, strict=True):
            assert values == pytest.approx(c.s - families._lag(c.s, c, part * length), abs=1e-12)


@pytest.mark.parametrize(("span", "unit", "found"), [(1.99, "rad", 0), (2.01, "rad", 6), (2.01, "m", 0)])
def test_a_drum_that_turns_far_enough_has_its_three_harmonics(span: float, unit: str, found: int) -> None:
    where = made(level=0.0)
    factor = span / np.ptp(np.concatenate([c.x for c in where]))
    where = [replace(c, x=factor * c.x) for c in where]
    terms = _turning(_Runs(where, unit, "N"))
    assert len(terms) == found
    for term, (k, function) in zip(terms, [(k, f) for k in (1, 2, 3) for f in (np.cos, np.sin)], strict=False):
        assert term.text == f"{function.__name__}({'' if k == 1 else k}x)"
        for c, values in zip(where, term.values, strict=True):
            assert values == pytest.approx(function(k * c.x), abs=1e-12)


def test_folds_are_runs_or_blocks_of_them() -> None:
    assert folds([2, 1, 3]).tolist() == [0, 0, 1, 2, 2, 2]
    assert folds([1] * 8).tolist() == [0, 1, 2, 3, 4, 5, 0, 1]
    assert folds([8]).tolist() == [0, 0, 1, 1, 2, 2, 3, 3]
    assert folds([4, 8]).tolist() == [0, 1, 2, 3, 4, 4, 5, 5, 6, 6, 7, 7]


def test_bands_lie_about_the_frequency_of_the_motion_and_hold_the_power_that_is_in_them() -> None:
    """A sine of 0.9 Hz; the residual is a line at three times that and one at 20 Hz, of known power."""
    n, dt, f = 4000, 0.01, 0.9
    t = dt * np.arange(n)
    x = 7.0 + 0.3 * np.sin(2 * np.pi * f * t)
    v = 2 * np.pi * f * 0.3 * np.cos(2 * np.pi * f * t)
    zero = np.zeros(n)
    c = Coordinates(x, v, zero, np.sign(v), np.sign(v), zero, zero, zero, None, t)
    residual = 2.0 * np.sin(2 * np.pi * 3 * f * t) + 1.0 * np.sin(2 * np.pi * 20.0 * t)
    noise = np.random.default_rng(3).normal(size=(n, 30))
    found = _bands([residual], [noise], [c])
    edges = [0.0, 0.5 * f, 2 * f, 8 * f, 50.0]  # 32 f would be beyond half of 50 Hz
    assert [b.range for b in found] == [pytest.approx(e, rel=2e-2) for e in pairwise(edges)]
    assert [b.share for b in found] == pytest.approx([0.0, 0.0, 0.8, 0.2], abs=5e-3)
    assert [b.background for b in found] == pytest.approx(np.diff(edges) / 50.0, abs=0.02)
