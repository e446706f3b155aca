"""ICINCO 2013: Dahl friction with branched sliding force, 1 and 0.8 Hz, in the closed loop of its rig."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...cosim.trajectory import Trajectory
from ...kernels.kernel import kernel
from ...report import Figure, Line
from ..claims import Claim, Method, Open, open_claim, statement_claim
from ..draw import plot
from ..result import PaperResult
from ..verdict import Condition, Kind, Span, Verdict
from .loop import AMPLITUDES_MM, FREQUENCIES_HZ, GEAR, TOO_LARGE_MM, followed_mm, limit_cycle, runs

MODEL = "SingleTsmDahl"
DRAWN = "5"
AMPLITUDE = Open("amplitude", f"{AMPLITUDES_MM[0]:g} to {AMPLITUDES_MM[-1]:g} mm", "not printed; see the drive's reach")
PULLEY = Open("radius of the pulley", "25 mm", "that of MSSP 2015")
SPRINGS = Open("springs", "1000 N/m, 18 N", "not printed")
SMALLEST = 1e-9


def result(quick: bool = False) -> PaperResult:
    """All claims and figures; ``quick`` takes fewer amplitudes."""
    found = runs(quick)
    cycles = {name: limit_cycle(run) for name, run in found.items()}
    claims = (
        *(_range(item, cycles) for item in FREQUENCIES_HZ),
        _reach(found["reach"]),
        _positive(),
        _two_values(),
        _continuous(found),
        _tensions(cycles),
        _steady(),
        _baseline(cycles),
    )
    return PaperResult(
        claims,
        {
            "Fig. 3": _tension_figures(cycles),
            **{item: _figures(cycles[f"{item}.{DRAWN}"]) for item in FREQUENCIES_HZ},
        },
        texts={
            item: f"Drawn for an amplitude of {DRAWN} mm at {f:g} Hz in the closed loop; the amplitude is not "
            "published."
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
    reached = followed_mm(run)
    most = float(np.abs(run.columns["controller.u"]).max())
    return open_claim(
        "icinco2013.reach",
        ("Fig. 6", "Fig. 2"),
        f"largest amplitude that the printed motor follows at 1 Hz through its gear {GEAR:g}:1",
        f"no amplitude is printed; asked for {TOO_LARGE_MM:g} mm the drive reaches this at {most:.0f} V, which bounds "
        "what the paper can have measured",
        ours=reached,
        unit="mm",
        assumed=(
            PULLEY,
            Open("data of the motor", "5.78 ohm, 34.9 mN.m/A", "not printed, series 2642 as quoted by others"),
        ),
        method=Method.CO_SIMULATION,
    )


def _positive() -> Claim:
    k = kernel(MODEL)
    p = k.params("published")
    speeds, rates = np.geomspace(1e-9, 0.1, 60), np.geomspace(1e-9, 1.0, 40)
    lowest = min(
        k.module.sliding_force(p, way * v, s * a, s) for v in speeds for a in rates for way in (-1, 1) for s in (-1, 1)
    )
    return statement_claim(
        "icinco2013.positive",
        "Table 1",
        "lowest F_f of the identified set",
        "N",
        "F_f is 'the force in sliding regime'",
        {"published set": Condition(lowest, ">=", SMALLEST)},
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
    steps = {
        name: float(np.max(np.abs(np.diff(run.columns["plant.F"][run.time > 1.0]))))
        for name, run in (("1 ms", found["coarse"]), ("0.5 ms", found[f"Fig. 6.{DRAWN}"]))
    }
    return statement_claim(
        "icinco2013.smooth",
        ("Section 3.2", "Fig. 6"),
        "largest change of F in a step, with half the step over the whole",
        "1",
        "'the transition from presliding to sliding regime is guaranteed to be smooth'",
        {"closed loop": Condition(steps["0.5 ms"] / steps["1 ms"], "<=", 0.75)},
        assumed=(AMPLITUDE,),
        why={Verdict.REPRODUCED: "F, an integral, has no jump: half a step changes it half as much"},
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


def _baseline(cycles: Mapping[str, Mapping[str, Any]]) -> Claim:
    left = []
    for name, cycle in cycles.items():
        if name.startswith("Fig."):
            force, way = cycle["F"], np.sign(cycle["v"])
            levels = {s: float(np.mean(np.abs(force[way == s]))) for s in (-1.0, 1.0)}
            coulomb = np.where(way > 0.0, levels[1.0], -levels[-1.0])
            left.append(float(np.mean((force - coulomb) ** 2)))
    return open_claim(
        "icinco2013.baseline",
        ("Fig. 7", "Fig. 6"),
        "mean square difference from one lumped mass with Coulomb friction, best level each way",
        "'better estimation results compared to the current approach utilizing lumped mass model' has no number; if "
        "the "
        "proposed model is right, this is what Coulomb friction leaves",
        ours=Span.of(*left),
        unit="N2",
        assumed=(AMPLITUDE,),
        method=Method.CO_SIMULATION,
    )


def _figures(cycle: Mapping[str, Any]) -> tuple[Figure, ...]:
    return (
        plot([Line("model", cycle["t"], cycle["F"])], "Friction over time", "time [s]", "F [N]"),
        plot([Line("model", cycle["v"], cycle["F"])], "over velocity", "velocity [mm/s]", "F [N]"),
        plot([Line("model", cycle["x"], cycle["F"])], "over position", "position [mm]", "F [N]"),
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
