"""Every verdict of ``tsm-fmu diagnose``, and what it writes beside it, on rigs in closed form."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from tsm_fmu.card import read_card
from tsm_fmu.cli.app import run
from tsm_fmu.cosim.replay import replay
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.logs.record import read_record

DT, ROWS = 0.01, 1600
FRICTION = {"sigma0": 109.0, "sigma1": 0.0, "sigma2": 0.117, "F_c": 0.73, "F_s": 0.73, "v_s": 0.3}
DRIVE = {
    "c": 0.97, "beta": -0.9, "alpha": 9.3, "ratio": 1.03, "sigma0": 5.4, "sigma1": 0.0, "sigma2": 0.0031,
    "tau_c": 0.104, "tau_s": 0.104, "v_s": 0.3, "tau_v": 0.0,
}  # fmt: skip

Array = np.ndarray


def stops(x: Array, reach: float, exponent: float = 1.0) -> Array:
    """Presliding state dz/dx = (1 - s z)^exponent / reach, exactly; Dahl's with exponent 1."""
    z, n = np.zeros(x.size), exponent
    for k in range(1, x.size):
        s, d = np.sign(x[k] - x[k - 1]), abs(x[k] - x[k - 1]) / reach
        u = 1.0 - s * z[k - 1]
        u = u * np.exp(-d) if n == 1.0 else (u ** (1.0 - n) + (n - 1.0) * d) ** (1.0 / (1.0 - n))
        z[k] = s * (1.0 - u)
    return z


def wandering(t: Array, rng: np.random.Generator) -> Array:
    """Speed of three sines."""
    v = np.zeros(t.size)
    for amplitude, f, p in zip((1.1, 0.6, 0.4), (0.13, 0.37, 1.3), rng.random(3) * 6.0, strict=True):
        v += amplitude * np.sin(2 * np.pi * f * t + p)
    return v


def steady(t: Array, rng: np.random.Generator) -> Array:
    return 1.07 * np.sin(2 * np.pi * 0.83 * t + 6.0 * rng.random())


def written(path: Path, names: Sequence[str], columns: Sequence[Array], kept: Array | None = None) -> Path:
    rows = np.column_stack(columns)
    rows = rows if kept is None else rows[kept]
    np.savetxt(path, rows, delimiter=",", header=",".join(names), comments="", fmt="%.10g")
    return path


def friction_log(
    path: Path, seed: int, more: Callable[[Array, Array, Array], Array] | None = None, speed: Callable = wandering,
    offset: float = 0.0, kept: Array | None = None, rows: int = ROWS,
) -> Path:  # fmt: skip
    """F = 0.73 z + 0.117 v, ``more(t, x, v)`` on top, with coloured noise."""
    rng = np.random.default_rng(seed)
    t = np.arange(rows) * DT
    v = speed(t, rng)
    x = np.cumsum(v) * DT
    noise = lfilter([np.sqrt(1.0 - 0.5**2)], [1.0, -0.5], 0.006 * rng.normal(size=rows))
    force = 0.73 * stops(x, 0.0067) + 0.117 * v + offset + noise
    if more is not None:
        force = force + more(t, x, v)
    return written(path, ["time [s]", "v [m/s]", "F [N]"], [t, v, force], kept)


def mass(t: Array, x: Array, v: Array) -> Array:
    return 0.041 * np.gradient(v, t)


def diagnosed(
    folder: Path, model: str, measured: Sequence[Path], *more: str, given: dict[str, float] | None = None
) -> dict[str, Any]:
    words = [w for path in measured for w in ("--measured", str(path))]
    words += [w for name, value in (FRICTION if given is None else given).items() for w in ("--set", f"{name}={value}")]
    assert run(["diagnose", model, *words, *more, "--out", str(folder), "--json"]) == 0
    return json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def with_mass(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Two runs, none held out, each with an offset of its own; a mass that the model has not."""
    folder = tmp_path_factory.mktemp("mass")
    runs = [
        friction_log(folder / f"{n}.csv", seed, mass, offset=o) for n, seed, o in (("a", 3, 0.009), ("b", 4, -0.008))
    ]
    return {**diagnosed(folder / "out", "LuGreFriction", runs), "runs": runs}


def test_two_runs_confirm_each_other_where_none_is_held_out(with_mass: dict[str, Any]) -> None:
    assert (with_mass["verdict"], with_mass["effects"]) == ("named", ["inertia"])
    best = with_mass["candidates"][0]
    assert best["effect"] == "inertia"
    assert best["gap_closure_holdout"] > 0.9  # each run judged by the fit to the other
    assert best["parameters"]["m"] == pytest.approx(0.041, rel=0.1)
    assert with_mass["gap"]["F"]["holdout_after"] is None


def test_the_keys_are_those_of_the_contract(with_mass: dict[str, Any]) -> None:
    assert set(with_mass) >= {
        "verdict", "effects", "equivalent", "not_excited", "candidates", "where", "gap", "card", "fmu", "report",
        "next_experiment",
    }  # fmt: skip
    for candidate in with_mass["candidates"]:
        assert set(candidate) >= {"effect", "score", "gap_closure_measured", "gap_closure_holdout", "parameters"}
    assert with_mass["where"]
    for place in with_mass["where"]:
        assert set(place) >= {"coordinate", "range", "unit", "share_of_gap", "p"}
    assert set(with_mass["gap"]["F"]) >= {
        "unit", "before", "after", "holdout_before", "holdout_after", "floor", "closure", "closure_interval",
    }  # fmt: skip
    scores = [c["score"] for c in with_mass["candidates"]]
    assert scores == sorted(scores, reverse=True)
    assert with_mass["next_experiment"] is None
    for name in ("card", "fmu", "report"):
        assert Path(with_mass[name]).is_file()


def test_the_fmu_of_runs_with_offsets_has_the_gap_of_the_workflow(with_mass: dict[str, Any]) -> None:
    gap = with_mass["gap"]["F"]
    assert gap["fmu"] == pytest.approx(gap["after"], rel=1e-6)
    card = read_card(with_mass["card"])
    offsets = {name: own["F.offset_drift.b"] for name, own in card.per_run.items()}
    assert offsets == {"a": pytest.approx(0.009, abs=0.003), "b": pytest.approx(-0.008, abs=0.003)}
    errors = []
    for path in with_mass["runs"]:
        record = read_record(path)
        simulated = replay(Path(with_mass["fmu"]), record, parameters=card.per_run[record.name]).columns["F"]
        errors.append((record.columns["F"] - simulated)[record.time >= with_mass["compared_from"][record.name]])
    assert np.sqrt(np.mean(np.concatenate(errors) ** 2)) == pytest.approx(gap["after"], rel=1e-6)
    alone = replay(Path(with_mass["fmu"]), read_record(with_mass["runs"][0])).columns["F"]
    error = read_record(with_mass["runs"][0]).columns["F"] - alone
    assert any("of its stroke" in note for note in with_mass["notes"])
    assert np.mean(error) == pytest.approx(0.0085, abs=0.004)  # without its own offset a run has that of the mean


def test_the_card_of_an_answer_misses_nothing_more(with_mass: dict[str, Any], tmp_path: Path) -> None:
    said = diagnosed(tmp_path / "d", with_mass["card"], with_mass["runs"], given={})
    assert said["verdict"] in ("none", "parameters")
    assert said["effects"] == []
    if said["verdict"] == "none":  # the card's zero is the mean of both runs, from which each is 0.0085 away
        apart = np.hypot(with_mass["gap"]["F"]["after"], 0.0085)
        assert said["gap"]["F"]["after"] == pytest.approx(apart, rel=0.05)


def test_a_model_with_its_effect_needs_parameters_only(with_mass: dict[str, Any], tmp_path: Path) -> None:
    given = {**FRICTION, "inertia.m": 0.013}
    said = diagnosed(tmp_path / "d", "LuGreFriction+inertia", with_mass["runs"], given=given)
    assert said["verdict"] == "parameters"
    assert said["effects"] == []
    assert "inertia" not in said["not_excited"]  # it is there
    assert read_card(said["card"]).parameters["inertia.m"].value == pytest.approx(0.041, rel=0.1)


def test_json_is_one_object_and_that_of_the_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = friction_log(tmp_path / "a.csv", 5, rows=900)
    said = diagnosed(tmp_path / "d", "LuGreFriction", [log])
    streams = capsys.readouterr()
    assert json.loads(streams.out) == said
    assert streams.err == ""
    assert said["verdict"] == "none"


def test_look_alikes_are_a_set_with_a_motion_that_separates_them(tmp_path: Path) -> None:
    """In steady strokes without a rest, what settles with time settles with travel."""

    def settling(t: Array, x: Array, v: Array) -> Array:
        return (0.73 * stops(x, 0.0067) + 0.117 * v) * 0.31 * np.exp(-t / 5.3)

    runs = [friction_log(tmp_path / f"{k}.csv", k, settling, steady) for k in (6, 7)]
    said = diagnosed(tmp_path / "d", "LuGreFriction", runs)
    assert said["verdict"] == "ambiguous"
    assert said["effects"] == []
    (group,) = said["equivalent"]
    assert {"thermal", "wear"} <= set(group)
    assert len(group) <= 3
    path = Path(said["next_experiment"])
    motion = read_record(path)
    with path.open(encoding="utf-8") as stream:
        assert next(csv.reader(stream))[0].startswith("time")
    measured = read_record(runs[0])
    assert set(motion.columns) >= {"v"}
    assert np.ptp(motion.time) > 5.0
    assert np.abs(motion.columns["v"]).max() <= 1.05 * np.abs(measured.columns["v"]).max()
    assert kernel("LuGreFriction").simulate(
        kernel("LuGreFriction").params(None, FRICTION), motion.time, motion.inputs_for(kernel("LuGreFriction"))
    ).shape == (motion.time.size, 2)


def test_stiffening_of_another_law_is_no_ripple_of_a_drum(tmp_path: Path) -> None:
    """Within a turn of the drum harmonics fit any smooth function of the position, better than a cubic the sinh."""

    def spring(t: Array, x: Array, v: Array) -> Array:
        return mass(t, x, v) + 0.061 * np.sinh(1.9 * x)

    *runs, held = (friction_log(tmp_path / f"{k}.csv", 11 + k, spring) for k in (0, 1, 9))
    said = diagnosed(tmp_path / "d", "LuGreFriction", runs, "--holdout", str(held))
    assert said["verdict"] == "named"
    assert "stiffness_hardening" in said["effects"]
    assert set(said["effects"]) <= {"stiffness_hardening", "inertia"}
    assert {"drum_periodic", "winding_crossover"} <= set(said["not_excited"])
    assert said["gap"]["F"]["closure_least"] > 0.9


def test_a_mass_is_seen_that_a_linear_step_beside_a_spring_does_not_show(tmp_path: Path) -> None:
    """The spring's fit takes part of the mass by sigma2, F_c and v_s, which have far to go back."""

    def log(name: str, seed: int, frequencies: tuple[float, float, float]) -> Path:
        rng = np.random.default_rng(seed)
        t = np.arange(2000) * DT
        v = np.zeros(t.size)
        for amplitude, f in zip((0.9, 0.5, 0.35), frequencies, strict=True):
            v += amplitude * np.sin(2 * np.pi * f * t + 6.28 * rng.random())
        x = np.cumsum(v) * DT
        noise = lfilter([np.sqrt(1.0 - 0.4**2)], [1.0, -0.4], 0.012 * rng.normal(size=t.size))
        force = 1.9 * stops(x, 0.011, 1.15) + 0.31 * v + 0.04 * np.gradient(v, DT) + 0.25 * x**3 + noise
        return written(tmp_path / f"{name}.csv", ["time [s]", "v [m/s]", "F [N]"], [t, v, force])

    runs = [log("one", 7, (0.15, 0.45, 1.6)), log("two", 8, (0.15, 0.45, 1.6))]
    held = log("held", 9, (0.11, 0.6, 1.3))
    given = {"sigma0": 170.0, "sigma1": 0.0, "sigma2": 0.3, "F_c": 1.9, "F_s": 1.9, "v_s": 0.3}
    said = diagnosed(tmp_path / "d", "LuGreFriction", runs, "--holdout", str(held), given=given)
    assert (said["verdict"], set(said["effects"])) == ("named", {"stiffness_hardening", "inertia"})
    card = read_card(said["card"])
    assert card.parameters["inertia.m"].value == pytest.approx(0.04, rel=0.05)
    assert card.parameters["stiffness_hardening.k_3"].value == pytest.approx(0.25, rel=0.08)
    assert said["gap"]["F"]["holdout_after"] < 0.05 * said["gap"]["F"]["holdout_refitted"]


def kink(t: Array, x: Array, v: Array) -> Array:
    """Friction only where the sheath has a kink, which no effect of the library is."""
    return 0.33 * np.exp(-(((x - np.median(x)) / 0.11) ** 2)) * np.tanh(v / 0.05)


def test_an_effect_outside_the_library_is_unknown_unless_reference_runs_have_it(tmp_path: Path) -> None:
    runs = [friction_log(tmp_path / f"{k}.csv", k, kink) for k in (8, 9)]
    said = diagnosed(tmp_path / "d", "LuGreFriction", runs)
    assert said["verdict"] == "unknown"
    assert said["effects"] == []
    assert said["gap"]["F"]["after"] > 5.0 * 0.006  # the noise
    calm = [friction_log(tmp_path / f"{k}.csv", k, kink) for k in (10, 11)]
    more = [w for path in calm for w in ("--reference", str(path))]
    again = diagnosed(tmp_path / "r", "LuGreFriction", runs, *more)
    assert again["verdict"] in ("none", "parameters")
    assert again["effects"] == []


def test_an_unknown_law_is_told_as_a_formula(tmp_path: Path) -> None:
    def thickening(t: Array, x: Array, v: Array) -> Array:
        return 0.27 * (x - x.min()) * v

    runs = [friction_log(tmp_path / f"{k}.csv", k, thickening) for k in (26, 27)]
    said = diagnosed(tmp_path / "d", "LuGreFriction", runs)
    assert (said["verdict"], said["effects"]) == ("unknown", [])
    formula = said["formulas"]["F"]
    assert formula["share"] > 0.5
    assert "x" in formula["text"]
    assert "v" in formula["text"]
    assert formula["text"] in said["answer"]


def test_an_effect_on_top_of_what_reference_runs_have_is_named(tmp_path: Path) -> None:
    both = [friction_log(tmp_path / f"{k}.csv", k, lambda *a: 0.5 * kink(*a) + mass(*a)) for k in (12, 13)]
    calm = [friction_log(tmp_path / f"{k}.csv", k, lambda *a: 0.5 * kink(*a)) for k in (14, 15)]
    said = diagnosed(tmp_path / "d", "LuGreFriction", both, *[w for path in calm for w in ("--reference", str(path))])
    assert (said["verdict"], said["effects"]) == ("named", ["inertia"])


def test_two_effects_are_found_in_sequence(tmp_path: Path) -> None:
    """A mass, and friction that settles; whether with time or with travel, motion without a rest may not tell."""

    def two(t: Array, x: Array, v: Array) -> Array:
        return 2.0 * mass(t, x, v) + (0.73 * stops(x, 0.0067) + 0.117 * v) * 0.37 * np.exp(-t / 5.3)

    runs = [friction_log(tmp_path / f"{k}.csv", k, two) for k in (16, 17)]
    held = friction_log(tmp_path / "held.csv", 18, two)
    said = diagnosed(tmp_path / "d", "LuGreFriction", runs, "--holdout", str(held))
    assert said["verdict"] == "named"
    assert "inertia" in said["effects"]
    second = {*said["effects"], *(e for group in said["equivalent"] for e in group)} - {"inertia"}
    assert second
    assert second <= {"thermal", "wear"}
    gap = said["gap"]["F"]
    assert gap["closure"] > 0.9
    assert gap["fmu"] == pytest.approx(gap["after"], rel=1e-6)


def drive_log(path: Path, seed: int, compliance: float) -> Path:
    """A drive with a play of 0.047 rad, and a tendon that stretches under its load."""
    rng = np.random.default_rng(seed)
    t = np.arange(ROWS) * DT
    x = 0.9 * np.sin(2 * np.pi * 0.31 * t) + 0.4 * np.sin(2 * np.pi * 0.83 * t + rng.random())
    x -= x[0]
    load = 0.17 + 0.21 * np.sin(2 * np.pi * 0.19 * t + 6.0 * rng.random())
    play = 0.97 * x - 0.0968 * stops(x, 0.1075) - compliance * load + 4e-4 * rng.normal(size=ROWS)
    torque = 1.03 * load + 0.104 * stops(x, 0.0193) + 0.0031 * np.gradient(x, DT) + 1e-3 * rng.normal(size=ROWS)
    names = ["time [s]", "x_in [rad]", "tau_out [N*m]", "x_out [rad]", "tau_in [N*m]"]
    return written(path, names, [t, x, load, play, torque])


def test_the_channel_that_lacks_something_is_told_from_the_one_that_does_not(tmp_path: Path) -> None:
    runs = [drive_log(tmp_path / f"{k}.csv", k, 0.19) for k in (19, 20)]
    held = drive_log(tmp_path / "held.csv", 21, 0.19)
    said = diagnosed(tmp_path / "d", "TendonDrive", runs, "--holdout", str(held), given=DRIVE)
    assert said["verdict"] == "named"
    assert said["places"] == ["tendon_elasticity@x_out"]
    assert set(said["gap"]) == {"x_out", "tau_in"}
    assert said["gap"]["x_out"]["closure"] > 0.9
    torque = said["gap"]["tau_in"]
    assert torque["after"] == pytest.approx(torque["refitted"], rel=0.1)
    for gap in said["gap"].values():
        assert gap["fmu"] == pytest.approx(gap["after"], rel=1e-6)


def sheath_log(path: Path, seed: int, mu: float) -> Path:
    """A drive whose sheath is bent while it moves; its friction is that of a belt on a drum, exp(mu Theta)."""
    rng = np.random.default_rng(seed)
    t = np.arange(ROWS) * DT
    x = 0.9 * np.sin(2 * np.pi * 0.31 * t) + 0.4 * np.sin(2 * np.pi * 0.83 * t + rng.random())
    load = 0.31 + 0.17 * np.sin(2 * np.pi * 0.19 * t + 6.0 * rng.random())
    bend = 2.3 + 1.7 * np.sin(2 * np.pi * 0.067 * t + 6.0 * rng.random())
    z = stops(x, 0.0193)
    torque = 1.03 * load + (0.104 + load * np.expm1(mu * bend)) * z + 0.0031 * np.gradient(x, DT)
    names = ["time [s]", "x_in [rad]", "tau_out [N*m]", "tau_in [N*m]", "Theta [deg]"]
    return written(path, names, [t, x, load, torque + 1e-3 * rng.normal(size=ROWS), np.degrees(bend)])


def test_a_sheath_angle_in_the_log_is_tried_by_itself(tmp_path: Path) -> None:
    runs = [sheath_log(tmp_path / f"{k}.csv", k, 0.053) for k in (31, 32)]
    held = sheath_log(tmp_path / "held.csv", 33, 0.053)
    said = diagnosed(tmp_path / "d", "TendonDrive", runs, "--holdout", str(held), given=DRIVE)
    assert (said["verdict"], said["effects"]) == ("named", ["bend_angle"])
    assert said["candidates"][0]["parameters"]["mu"] == pytest.approx(0.057, rel=0.1)  # slope of expm1 over the range
    assert said["gap"]["tau_in"]["closure"] > 0.9
    assert said["gap"]["tau_in"]["fmu"] == pytest.approx(said["gap"]["tau_in"]["after"], rel=1e-6)
    straight = [sheath_log(tmp_path / f"{k}.csv", k, 0.0) for k in (34, 35)]
    said = diagnosed(tmp_path / "s", "TendonDrive", straight, given=DRIVE)
    assert (said["verdict"], said["effects"]) == ("none", [])
    assert "bend_angle" not in said["not_excited"]  # it would have shown


def test_a_past_that_the_log_does_not_show_is_no_gap(tmp_path: Path) -> None:
    """A run that begins at rest, its presliding stretched by the stroke before."""
    runs = []
    for seed, before in ((36, 0.9), (37, -0.7)):
        t = np.arange(ROWS) * DT
        v = np.where(t < 1.3, 0.0, wandering(np.maximum(t - 1.3, 0.0), np.random.default_rng(seed)))
        x = np.cumsum(v) * DT
        travel = np.cumsum(np.abs(np.diff(x, prepend=x[0])))
        force = 0.73 * (stops(x, 0.0067) + before * np.exp(-travel / 0.0067)) + 0.117 * v  # Dahl's z from another start
        force += 0.004 * np.random.default_rng(seed + 50).normal(size=ROWS)
        runs.append(written(tmp_path / f"{seed}.csv", ["time [s]", "v [m/s]", "F [N]"], [t, v, force]))
    said = diagnosed(tmp_path / "d", "LuGreFriction", runs)
    assert (said["verdict"], said["effects"]) == ("none", [])
    assert all(1.3 < begin < 1.8 for begin in said["compared_from"].values())


def controlled_log(path: Path, seed: int) -> Path:
    """An admittance controller: the speed gives way to the measured force, and its noise, one sample later."""
    rng = np.random.default_rng(seed)
    t = np.arange(ROWS) * DT
    wanted = 1.4 * wandering(t, rng)
    v, force, z, noise = np.zeros(ROWS), np.zeros(ROWS), 0.0, 0.006 * rng.normal(size=ROWS)
    for k in range(1, ROWS):
        v[k] = v[k - 1] + 0.4 * (wanted[k] - 0.29 * force[k - 1] - v[k - 1])
        s = np.sign(v[k])
        z = s + (z - s) * np.exp(-abs(v[k]) * DT / 0.0067)
        force[k] = 0.73 * z + 0.117 * v[k] + 0.041 * (v[k] - v[k - 1]) / DT + noise[k]
    return written(path, ["time [s]", "v [m/s]", "F [N]"], [t, v, force])


def test_a_motion_that_reacts_to_the_output_gives_the_same_name(tmp_path: Path) -> None:
    runs = [controlled_log(tmp_path / f"{k}.csv", k) for k in (22, 23)]
    said = diagnosed(tmp_path / "d", "LuGreFriction", runs)
    assert (said["verdict"], said["effects"]) == ("named", ["inertia"])
    assert said["candidates"][0]["parameters"]["m"] == pytest.approx(0.041, rel=0.15)


def test_missing_rows_are_told_and_do_not_make_a_name(tmp_path: Path) -> None:
    kept = np.r_[0:700, 790:ROWS]
    runs = [friction_log(tmp_path / "a.csv", 24, kept=kept), friction_log(tmp_path / "b.csv", 25)]
    said = diagnosed(tmp_path / "d", "LuGreFriction", runs)
    assert said["effects"] == []
    assert said["verdict"] in ("none", "parameters")
    assert any(note.startswith("a: ") and "gap" in note for note in said["notes"])
