"""MSSP 2015: a compensated loop that keeps an error of 3 deg, and what a diagnosis of its log takes away of it.

The loop is that of ``tsm-fmu run mssp_feedforward``, co-simulated from FMUs; its plant differs from the model in the
compensator. The user logs drive and distal angle (encoder noise on both) on the periodic motion, holds out the
non-periodic one, and asks ``tsm-fmu diagnose`` about the compensator's model. What it finds goes into the compensator.

* ``slope``: a plant of the published loop width with B = 0.65 or 0.70, compensated by law 1 with the
  published parameters. The model's own parameters can say this: nothing is missing, and the answer must be
  ``parameters``. With the plant's parameters law 1 keeps its own 3 deg, which no parameter removes (its observer is
  driven by the reference); the exact inverse, law 2, removes them, and with the published parameters it cannot be used.
* ``contact``: the tool meets tissue at 40 deg and the tendon stretches under the load, x_out = x_b - C tau(x_b); with
  tau(x_out) it would be an algebraic loop. The model (that of `TendonDrive`, which sees the load) is right in free
  motion; law 2 keeps 3 deg. Answer: ``tendon_elasticity``. In the compensator the expected load (`RotationalLoad` on
  the reference) times the compliance is added to the reference.
* ``pulley``: the distal pulley is smaller than in the identification, whose parameters the card holds fixed: 2.4 %
  more angle. Answer: ``gain_error``. The compensator becomes the chain with ``gain_error@x_r``, its inverse. (With free
  parameters the answer is ``parameters``: c and beta scale.)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from tsm_fmu.card import ModelCard, read_card
from tsm_fmu.cosim.cases import run_cases
from tsm_fmu.cosim.system import Component, Connection, Experiment, System, Value
from tsm_fmu.cosim.trajectory import Trajectory
from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.kernels.chain import chain
from tsm_fmu.kernels.kernel import kernel
from tsm_fmu.scenarios import mssp_feedforward as scenario
from tsm_fmu.scenarios.pid_design import design_pid

from .case import Answer, Case, answered, carded, logged

ENCODER, TORQUE = 1e-4, 1e-3
"""RMS noise of angles [rad] and torque [N.m]."""
SAMPLE = 5
"""Communication steps of 1 ms per row of the log."""
RECORD = ("motor.phi", "distal.y", "load.tau", "error.y")
COMPLIANCE = 0.06
"""Of the tendon under contact [rad/(N.m)]: 3 deg at the load of the stop."""
RATIO = 1.024
"""Of the pulleys: 3 deg of 120 deg."""


@dataclass(frozen=True)
class Rig:
    """A plant and its user.

    Attributes
    ----------
    hidden, model, expected : str
        As in `Case`.
    slope : float
        B of the plant.
    known : mapping of str to value
        Parameters of the user's model and compensator.
    law : int
        Of the compensator before.
    distal : mapping of str to float
        Gains of what makes the distal angle of backlash output (k1) and load (k2).
    load : str
        Preset of `RotationalLoad`.
    fixed : bool
        The user's card holds its parameters fixed.
    """

    hidden: str
    model: str
    expected: str
    slope: float
    known: Mapping[str, Value]
    law: int = 2
    distal: Mapping[str, float] = field(default_factory=dict)
    load: str = "spring"
    fixed: bool = False


def rigs() -> dict[str, Rig]:
    """All rigs by name."""
    published, mild = scenario.plant(), scenario.plant(0.65)
    return {
        "slope_065": Rig("slope B = 0.65", "PairedTsmBacklash", "parameters", 0.65, published, law=1),
        "slope_070": Rig("slope B = 0.70", "PairedTsmBacklash", "parameters", 0.70, published, law=1),
        "contact": Rig(
            "stretch under contact", "TendonDrive", "tendon_elasticity", 0.65, mild,
            distal={"k2": -COMPLIANCE}, load="stop",
        ),
        "pulley": Rig(
            "smaller pulley", "PairedTsmBacklash", "gain_error", 0.65, mild, distal={"k1": RATIO}, fixed=True
        ),
    }  # fmt: skip


@dataclass(frozen=True)
class Tracked:
    """Error of the compensated loop [deg peak to peak], by motion."""

    compensator: str
    peak_to_peak: Mapping[str, float]


def worked(
    name: str, fmus: Mapping[str, Path], folder: Path, *, again: Sequence[str] = tuple(scenario.MOTIONS),
    experiment: Experiment = scenario.EXPERIMENT,
) -> tuple[Answer, list[Tracked]]:  # fmt: skip
    """Co-simulate the loop, diagnose its log, and run it again with what was found.

    Parameters
    ----------
    name : str
        Of `rigs`.
    fmus : mapping of str to Path
        By model name.
    folder : Path
        For logs and diagnosis.
    again : sequence of str
        Motions that are run again.
    experiment : Experiment
        How long.

    Returns
    -------
    Answer, list of Tracked
        The loop as it was, then corrected: with either law where parameters were the answer.
    """
    rig = rigs()[name]
    before = {motion: loop(rig, fmus, motion, rig.known, rig.law) for motion in scenario.MOTIONS}
    tracked, runs = _run(before, f"as it was, law {rig.law}", experiment)
    logs = {}
    for seed, (motion, run) in enumerate(runs.items()):
        signals = {"x_in": ("motor.phi", ENCODER), "x_out": ("distal.y", ENCODER), "tau_out": ("load.tau", TORQUE)}
        columns = {
            column: (run.columns[source][::SAMPLE], "N.m" if column == "tau_out" else "rad", noise)
            for column, (source, noise) in signals.items()
        }
        logs[motion] = logged(folder / f"{motion}.csv", run.time[::SAMPLE], columns, seed)
    card = carded(folder / "compensator.toml", rig.model, rig.known, tuple(rig.known) if rig.fixed else ())
    case = Case("MSSP 2015", rig.hidden, str(card), rig.expected, [logs["periodic"]], [logs["non_periodic"]])
    answer = answered(case, folder / "diagnosis")
    found = read_card(folder / "diagnosis" / "card.toml")
    laws = (1, 2) if answer.verdict == "parameters" else (2,)
    after = []
    for law in laws:
        systems = {motion: corrected(rig, fmus, motion, found, law, folder) for motion in again}
        after.append(_run(systems, f"corrected, law {law}", experiment)[0])
    return answer, [tracked, *after]


def _run(
    systems: Mapping[str, System], compensator: str, experiment: Experiment
) -> tuple[Tracked, dict[str, Trajectory]]:
    cases = {motion: (system, experiment) for motion, system in systems.items()}
    runs = run_cases(cases, record=RECORD)
    errors = {m: np.degrees(run.columns["error.y"][experiment.window(run.time)]) for m, run in runs.items()}
    return Tracked(compensator, {m: float(np.ptp(error)) for m, error in errors.items()}), runs


def loop(rig: Rig, fmus: Mapping[str, Path], motion: str, known: Mapping[str, Value], law: int) -> System:
    """The scenario's loop around this rig's plant and load."""
    preset, _ = scenario.MOTIONS[motion]
    gains = design_pid(step=scenario.EXPERIMENT.step).gains
    system = scenario.loop(fmus, motion, preset, gains, scenario.plant(rig.slope), {**known, "law": law})
    system = system.with_values({f"load.{n}": v for n, v in kernel("RotationalLoad").presets[rig.load].si.items()})
    wires = [w for w in system.connections if w.target != "error.u2"]
    wires += [
        Connection("backlash.x_out", "distal.u1"),
        Connection("load.tau", "distal.u2"),
        Connection("distal.y", "error.u2"),
    ]
    distal = Component("distal", fmus["Sum"], {"k1": 1.0, "k2": 0.0, "k3": 0.0, "u3": 0.0, **rig.distal})
    return replace(system, components=(*system.components, distal), connections=tuple(wires))


def corrected(
    rig: Rig, fmus: Mapping[str, Path], motion: str, found: ModelCard, law: int, folder: Path
) -> System:  # fmt: skip
    """The loop with what the diagnosis found in the compensator; the plant is the same."""
    values = {n: p.value for n, p in found.parameters.items()}
    system = loop(rig, fmus, motion, {n: values[n] for n in ("c", "beta", "alpha")}, law)
    if "tendon_elasticity@x_out" in found.effects:
        wires = [w for w in system.connections if w.target != "compensator.x_r"]
        wires += [
            Connection("reference.y", "expected_load.phi"),
            Connection("expected_load.tau", "stretched.u2"),
            Connection("reference.y", "stretched.u1"),
            Connection("stretched.y", "compensator.x_r"),
        ]
        load = kernel("RotationalLoad").presets[rig.load].si
        gains = {"k2": values["x_out.tendon_elasticity.compliance"], "k3": 0.0, "u3": 0.0}
        added = (Component("expected_load", fmus["RotationalLoad"], load), Component("stretched", fmus["Sum"], gains))
        return replace(system, components=(*system.components, *added), connections=tuple(wires))
    if "gain_error@x_out" in found.effects:
        inverse = 1.0 / (1.0 + values["x_out.gain_error.g"]) - 1.0
        fmu = folder / "compensator.fmu"
        if not fmu.exists():
            build_fmu(chain("FeedforwardCompensator", ("gain_error@x_r",)), fmu)
        components = [
            replace(c, fmu=fmu, parameters={**c.parameters, "x_r.gain_error.g": inverse})
            if c.name == "compensator" else c
            for c in system.components
        ]  # fmt: skip
        return replace(system, components=tuple(components))
    return system
