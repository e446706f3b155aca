"""ICINCO 2013: Dahl friction with branched sliding force, 1 and 0.8 Hz, in the closed loop of its rig."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from ...cosim.system import Experiment
from ...cosim.trajectory import Trajectory
from ...kernels.arrays import FloatArray
from ...kernels.kernel import kernel
from ...report import Figure, Line
from ..baseline import Rubbed
from ..baseline import left as lumped
from ..claims import Claim, Method, Open, open_claim, statement_claim
from ..draw import plot
from ..loops import co_simulate
from ..motions import driven, signal
from ..preparation import left, predicted
from ..recovery import Motion, Recovery, Trial, recovered, recovery_claim, recovery_table
from ..result import PaperResult
from ..verdict import Condition, Kind, Span, Verdict
from .loop import AMPLITUDES_MM, ENCODER, FREQUENCIES_HZ, GEAR, TOO_LARGE_MM, R, limit_cycle, reach_mm, runs

MODEL = "SingleTsmDahl"
DRAWN = "5"
AMPLITUDE = Open("amplitude", f"{AMPLITUDES_MM[0]:g} to {AMPLITUDES_MM[-1]:g} mm", "not printed; see the drive's reach")
PULLEY = Open("radius of the pulley", "25 mm", "that of MSSP 2015")
SPRINGS = Open("springs", "1000 N/m, 18 N", "not printed")
SMALLEST = 1e-9
CUTOFFS_HZ = (5.0, 10.0, 20.0, 50.0)
NOISE_N = 0.07
NAMES = ("rho1", "rho2", "mu1", "mu2", "mu3", "kappa1", "kappa2", "kappa3", "kappa4", "kappa5", "sigma")
"""Identified parameters, Table 1."""


def result(quick: bool = False) -> PaperResult:
    """All claims and figures; ``quick`` takes fewer amplitudes."""
    found = runs(quick)
    cycles = {name: limit_cycle(run) for name, run in found.items()}
    identified = recovered({"table": trial()}, quick)["table"]
    claims = (
        *(_range(item, cycles) for item in FREQUENCIES_HZ),
        _reach(found["reach"]),
        _positive(),
        _two_values(),
        _continuous(found),
        _tensions(cycles),
        _steady(),
        _baseline(found),
        _prepared(found),
        _unique(identified),
    )
    return PaperResult(
        claims,
        {
            "Fig. 3": _tension_figures(cycles),
            "Fig. 5": _phase_figures(cycles[f"Fig. 6.{DRAWN}"]),
            **{
                item: (*_figures(cycles[f"{item}.{DRAWN}"]), _error_figure(found[f"{item}.{DRAWN}"]))
                for item in FREQUENCIES_HZ
            },
        },
        {"Table 1": recovery_table(identified)},
        {
            item: f"Drawn for an amplitude of {DRAWN} mm at {f:g} Hz in the closed loop; neither the amplitude nor the "
            "measured force is published, so the error is the part of it that encoder and differentiation make."
            for item, f in FREQUENCIES_HZ.items()
        },
    )


def _range(item: str, cycles: Mapping[str, Mapping[str, Any]]) -> Claim:
    own = [c["F"] for name, c in cycles.items() if name.startswith(f"{item}.")]
    high, low = (Span.of(*(getattr(f, how)() for f in own)) for how in ("max", "min"))
    return open_claim(
        f"icinco2013.range_{item[-1]}",
        item,
        f"range of F in the limit cycle at {FREQUENCIES_HZ[item]:g} Hz, closed loop",
        f"neither amplitude nor measurements are published; highest {high}, lowest {low} N over the amplitudes",
        ours=Span.of(*high.ends, *low.ends),
        unit="N",
        assumed=(AMPLITUDE, PULLEY, SPRINGS),
        method=Method.CO_SIMULATION,
    )


def _reach(run: Trajectory) -> Claim:
    most = float(np.abs(run.columns["controller.u"]).max())
    return open_claim(
        "icinco2013.reach",
        ("Fig. 6", "Fig. 2"),
        f"largest amplitude of a sine at 1 Hz whose speed the printed motor reaches through its gear {GEAR:g}:1",
        f"no amplitude is printed; asked for {TOO_LARGE_MM:g} mm the drive runs into its {most:.0f} V, which bounds "
        "what the paper can have measured",
        ours=reach_mm(run),
        unit="mm",
        assumed=(
            PULLEY,
            Open("data of the motor", "5.78 ohm, 34.9 mN.m/A", "not printed, series 2642 as quoted by others"),
        ),
        method=Method.CO_SIMULATION,
    )


@cache
def _lowest() -> float:
    """Lowest sliding force [N] over a grid of v and a."""
    k = kernel(MODEL)
    p = k.params("published")
    speeds, rates = np.geomspace(1e-9, 0.1, 60), np.geomspace(1e-9, 1.0, 40)
    return min(
        k.module.sliding_force(p, way * v, s * a, s) for v in speeds for a in rates for way in (-1, 1) for s in (-1, 1)
    )


def _positive() -> Claim:
    return statement_claim(
        "icinco2013.positive",
        "Table 1",
        "lowest F_f of the identified set",
        "N",
        "F_f is 'the force in sliding regime'",
        {"published set": Condition(_lowest(), ">=", SMALLEST)},
        why={Verdict.REPRODUCED: "the set is bounded as printed, |F| <= max(|F at the start|, sup F_f)"},
    )


def _two_values() -> Claim:
    k = kernel(MODEL)
    p = k.params("published")

    def jump(v: float) -> float:
        return abs(k.module.sliding_force(p, v, 0.0, 1.0) - k.module.sliding_force(p, v, 0.0, -1.0))

    return statement_claim(
        "icinco2013.two_values",
        ("Section 3.1", "Table 1"),
        "difference of the two forces that Eqs (2c) and (2d) give at zero acceleration, v = -1 um/s",
        "N",
        "F_f = G_anvn if a <= 0, v <= 0; G_apvn if a >= 0, v <= 0: both at a = 0",
        {"v < 0": Condition(jump(-1e-6), "<=", 1e-9)},
        why={
            Verdict.INTERNAL_ERROR: f"2 |mu3| exp(-kappa4 |v|/kappa5): {jump(-1e-7):.2g} N near rest, "
            f"{jump(-1e-5):.1g} N "
            f"from 10 um/s on; for v > 0 {jump(1e-6):.1g} N"
        },
    )


def _continuous(found: Mapping[str, Trajectory]) -> Claim:
    readings = {}
    for name, run in (("1 ms", found["coarse"]), ("0.5 ms", found[f"Fig. 6.{DRAWN}"])):
        later = run.time > 1.0
        force, speed = run.columns["plant.F"][later], R * run.columns["motor.omega"][later]
        most = kernel(MODEL).params("published").sigma * np.abs(speed).max() * (1.0 + np.abs(force).max() / _lowest())
        change = float(np.max(np.abs(np.diff(force))))
        readings[name] = Condition(change, "<=", float(most * (run.time[1] - run.time[0])))
    return statement_claim(
        "icinco2013.smooth",
        ("Section 3.2", "Fig. 5", "Fig. 6"),
        "largest change of F in a step of the closed loop",
        "N",
        "'the transition from presliding to sliding regime is guaranteed to be smooth'",
        readings,
        assumed=(AMPLITUDE,),
        why={
            Verdict.CONSISTENT: "the limit is that of Eqs (4), (5) for F without a jump, |dF/dt| <= sigma |v| "
            "(1 + |F|/F_f), and goes with the step"
        },
        method=Method.CO_SIMULATION,
    )


def _tensions(cycles: Mapping[str, Mapping[str, Any]]) -> Claim:
    cycle = cycles[f"Fig. 6.{DRAWN}"]
    least = float(np.min(-(cycle["T_in"] + cycle["T_out"]) - cycle["F"]))
    return statement_claim(
        "icinco2013.balance",
        ("Eq. (1)", "Fig. 3"),
        "largest F that T_in + T_out + F = 0 leaves, if T_in and T_out are the readings of the load cells",
        "N",
        "T_in + T_out + F = 0; 'T_in and output T_out can be measured by two load cells'",
        {"tensions >= 0": Condition(float(np.max(-(cycle["T_in"] + cycle["T_out"]))), ">=", float(cycle["F"].max()))},
        kind=Kind.READING,
        assumed=(AMPLITUDE, SPRINGS),
        why={
            Verdict.READING_EXCLUDED: f"two tensions never add up to less than nothing ({least:.3g} N off); Eq. (1) is "
            "meant for signed axial forces, F = T_in - T_out as in MMT 2015: a convention, no error"
        },
        method=Method.CO_SIMULATION,
    )


def _steady() -> Claim:
    k = kernel(MODEL)
    p = k.params("published", {"mu3": 0.0})
    v = 3e-3
    rows = np.tile([v, 0.0, 0.0, 0.0], (2, 1))
    force = k.simulate(p, np.array([0.0, 100.0]), rows)[-1, 0]
    level = k.module.sliding_force(p, v, 0.0, 0.0)
    zeta = force / (p.sigma * 1e-3)
    return statement_claim(
        "icinco2013.steady",
        "Section 3.2",
        "|zeta/F_f - 1| after 100 s at 3 mm/s by Eq. (4)",
        "1",
        "'At steady state, the normalized friction force zeta(t) = F_c'",
        {"Eq. (4)": Condition(abs(zeta / level - 1.0), "<=", 1e-6)},
        why={
            Verdict.INTERNAL_ERROR: f"it is sigma zeta that settles there: |sigma zeta/F_f - 1| = "
            f"{abs(force / level - 1.0):.1g}"
        },
    )


def _baseline(found: Mapping[str, Trajectory]) -> Claim:
    unexplained: dict[str, list[float]] = {}
    for name, run in found.items():
        if name.startswith("Fig. 6"):
            x, v, tension = R * run.columns["motor.phi"], run.columns["motor.omega"], run.columns["load.tau"] / R
            rubbed = Rubbed(run.time, x, v, tension, run.columns["plant.F"], run.time > run.time[-1] / 3.0)
            for masses, off in lumped(rubbed).items():
                unexplained.setdefault(masses, []).append(float(np.mean(off**2)))
    spans = {masses: Span.of(*values) for masses, values in unexplained.items()}
    return open_claim(
        "icinco2013.baseline",
        ("Fig. 6", "Fig. 7"),
        "mean square error of lumped masses with Coulomb friction at their best, 1 Hz",
        "'better estimation results compared to the current approach utilizing lumped mass model' has no number; if "
        "the proposed model is right, this is what they leave: "
        + ", ".join(f"{span} N2 ({masses})" for masses, span in spans.items()),
        ours=Span.of(*(end for span in spans.values() for end in span.ends)),
        unit="N2",
        assumed=(AMPLITUDE, SPRINGS),
        method=Method.CO_SIMULATION,
    )


def _prepared(found: Mapping[str, Trajectory]) -> Claim:
    run = found[f"Fig. 6.{DRAWN}"]
    force, scored = run.columns["plant.F"], run.time > 1.0
    off = left(MODEL, "published", run.time, _counts(run), force, scored=scored, cutoffs=CUTOFFS_HZ)
    residuals_text = ", ".join(f"{value:.3g} at {f:g} Hz" for f, value in off.items())
    return open_claim(
        "icinco2013.prepared",
        ("Fig. 6", "Fig. 2"),
        "mean square error of F that the encoder of 5 um, filtfilt and differentiation alone make, 1 Hz",
        f"neither an error nor the preparation is printed; {residuals_text} N2",
        ours=Span.of(*off.values()),
        unit="N2",
        assumed=(AMPLITUDE, Open("cut-off of the filter", "5 to 50 Hz", "not printed")),
        method=Method.CO_SIMULATION,
    )


def _counts(run: Trajectory) -> FloatArray:
    """Travel as the linear encoder at the drive reads it [m]."""
    return ENCODER * np.round(R * run.columns["motor.phi"] / ENCODER)


def _error_figure(run: Trajectory) -> Figure:
    """Error of the model from prepared signals against its force in the loop, after the first cycle."""
    last = run.time > run.time[-1] / 3.0
    lines = [
        Line(
            f"cut-off {f:g} Hz",
            run.time[last],
            (predicted(MODEL, "published", run.time, _counts(run), f) - run.columns["plant.F"])[last],
        )
        for f in CUTOFFS_HZ
    ]
    return plot(lines, "Error of the model from encoder and differentiation", "time [s]", "error [N]")


def trial() -> Trial:
    """The set of Table 1 on two cycles of an imposed sine at 1 Hz and the drawn amplitude."""
    case = driven(MODEL, signal([(1e-3 * float(DRAWN), 1.0)]), Experiment(stop=2.0, step=8e-3), "published")
    run = co_simulate({"table": case})["table"]
    inputs = {"x": ("reference.y", 1.0), "v": ("reference.dy", 1.0), "a": ("reference.ddy", 1.0)}
    motion = Motion(run, inputs, "plant.F", (0.0, 2.0))
    return Trial(MODEL, "published", "F", (motion,), NAMES, NOISE_N, 8e-3, encoder=ENCODER, cutoff=20.0)


def _unique(found: Recovery) -> Claim:
    return recovery_claim(
        "icinco2013.reading_unique",
        ("Table 1", "Fig. 6"),
        "'the identification of the friction force ... consisting 11 parameters for a sinusoidal input signal 1 Hz'",
        found,
        kind=Kind.READING,
        assumed=(AMPLITUDE, Open("noise", f"{NOISE_N:g} N rms", "not printed; that of IFToMM 2013")),
        text="one sine hides how friction turns with the acceleration near rest",
    )


def _figures(cycle: Mapping[str, Any]) -> tuple[Figure, ...]:
    return (
        plot([Line("model", cycle["t"], cycle["F"])], "Friction over time", "time [s]", "F [N]"),
        plot([Line("model", cycle["v"], cycle["F"])], "over velocity", "velocity [mm/s]", "F [N]"),
        plot([Line("model", cycle["x"], cycle["F"])], "over position", "position [mm]", "F [N]"),
    )


def _phase_figures(cycle: Mapping[str, Any]) -> tuple[Figure, ...]:
    """Friction of the last cycle by the signs of speed and acceleration, which choose the branch of Eq. (2)."""
    last = cycle["t"] > cycle["t"][-1] - 1.0 / FREQUENCIES_HZ["Fig. 6"]
    speed, force, x = (cycle[name][last] for name in ("v", "F", "x"))
    faster = np.gradient(speed) > 0.0
    phases = {
        "v > 0, a > 0": (speed > 0.0) & faster,
        "v > 0, a < 0": (speed > 0.0) & ~faster,
        "v < 0, a < 0": (speed <= 0.0) & ~faster,
        "v < 0, a > 0": (speed <= 0.0) & faster,
    }
    drawn = {name: np.where(here, force, np.nan) for name, here in phases.items()}
    return (
        plot([Line(n, x, f) for n, f in drawn.items()], "Phases over position", "position [mm]", "F [N]"),
        plot([Line(n, speed, f) for n, f in drawn.items()], "Phases over velocity", "velocity [mm/s]", "F [N]"),
    )


def _tension_figures(cycles: Mapping[str, Mapping[str, Any]]) -> tuple[Figure, ...]:
    found = []
    for item, f in FREQUENCIES_HZ.items():
        cycle = cycles[f"{item}.{DRAWN}"]
        lines = [Line(name, cycle["t"], cycle[name]) for name in ("T_in", "T_out")]
        found.append(plot(lines, f"Tensions at {f:g} Hz", "time [s]", "T [N]"))
    cycle = cycles[f"Fig. 6.{DRAWN}"]
    found.append(
        plot([Line("T_out over T_in", cycle["T_in"], cycle["T_out"])], "Both at 1 Hz", "T_in [N]", "T_out [N]")
    )
    return tuple(found)
