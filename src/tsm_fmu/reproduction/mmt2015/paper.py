"""MMT 2015: modified LuGre friction; its readings are told apart by the paper's own LuGre comparison."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import product

import numpy as np

from ...cosim.trajectory import Trajectory
from ...kernels.kernel import kernel
from ...models.single_tsm_lugre import escape_time, sliding_level
from ...scenarios.papers import MMT_FIG_4
from ...scenarios.single_tsm_force import DRIVEN, R
from ..baseline import Rubbed
from ..baseline import left as lumped
from ..claims import Claim, Method, Open, number_claim, open_claim, statement_claim
from ..motions import sines
from ..preparation import CUTOFF, left
from ..recovery import Recovery, recovered, recovery_claim, recovery_table
from ..result import PaperResult
from ..shapes import shape_figures, transition_claim
from ..verdict import Condition, Kind, Span, Verdict
from .figures import CYCLE, fig4_acceleration, fig4_level, force_figures, lugre_figures, sliding_figures
from .forces import EXPERIMENT, MOTIONS, NON_PERIODIC, PERIODIC, WINDOWS, mse, plant, runs, trials
from .printed import ERROR, MSE, MSE_LUGRE, allowed_mse
from .readings import EQUATIONS, MODEL, PRESETS, blow_up, fitted_lugre, signed_level

ORDER = Open("order of the pull branches", "as printed, or as in ICINCO 2013", "Eqs (7), (8) against the other papers")
SIGN = Open("sign of mu3", "Eqs (10)-(12), or Eq. (9)", "the print has both")
WINDOW = Open("window", "first, second or both cycles", "not printed")
MEASURED = "the error is against measurements that are not published"


def result(quick: bool = False) -> PaperResult:
    """All claims and figures; ``quick`` leaves the LuGre fit to one order of the branches."""
    found = runs()
    periodic = found["Fig. 6"]
    identified = recovered(trials(found), quick)
    claims = (
        _triangle(periodic),
        _refit(periodic, quick),
        _fig4(),
        *_ranges(found),
        _fit_error("Fig. 6"),
        _fit_error("Fig. 7"),
        *(_prepared(found, item) for item in MOTIONS),
        *_unique(identified),
        _bent_less(found),
        _baseline(found),
        transition_claim("mmt2015.configuration", "Fig. 8", ERROR.span.middle, quick),
        *_as_printed(),
    )
    return PaperResult(
        claims,
        {
            "Fig. 3": lugre_figures(periodic),
            "Fig. 4": sliding_figures(),
            "Fig. 8": shape_figures(quick),
            "Fig. 6": force_figures(found, "Fig. 6", "periodic"),
            "Fig. 7": force_figures(found, "Fig. 7", "non_periodic"),
        },
        {"Fig. 6": recovery_table(identified["set"]), "Fig. 3": recovery_table(identified["LuGre"])},
        {
            "Fig. 3": (
                "Both published models were fitted to the same measured force, so the triangle inequality bounds the "
                "mean square difference between them: it must lie in (sqrt(1.4538) -+ sqrt(0.027))^2, if the print "
                "can be read as the authors ran it."
            )
        },
    )


def _readings() -> list[tuple[str, str]]:
    return list(product(PRESETS, EQUATIONS))


def _triangle(run: Trajectory) -> Claim:
    found = {
        f"{b}, {e}, {w}": mse(run.columns[f"{plant(b, e)}.F"], run.columns["lugre.F"], run.time, w)
        for b, e in _readings()
        for w in WINDOWS
    }
    allowed = allowed_mse()
    inside = [name for name, value in found.items() if allowed.span.holds(Span.of(value))]
    return number_claim(
        "mmt2015.lugre_apart",
        "Fig. 3",
        "mean square difference of the two published models, |S|",
        allowed,
        Span.of(*found.values()),
        assumed=(ORDER, SIGN, WINDOW),
        why={Verdict.NOT_DETERMINED: f"{len(inside)} of {len(found)} readings and windows lie inside {allowed.span}"},
        method=Method.CO_SIMULATION,
    )


def _refit(run: Trajectory, quick: bool) -> Claim:
    motion = sines(PERIODIC, 10.0, 2e-3)
    scored = motion.time >= CYCLE
    step = 2
    branches = list(PRESETS)[:1] if quick else list(PRESETS)
    forces = {b: run.columns[f"{plant(b, 'Eqs (10)-(12)')}.F"][::step][: motion.time.size] for b in branches}
    best = {b: fitted_lugre(motion, f, scored)[1] for b, f in forces.items()}
    near = math.sqrt(MSE["Fig. 6"].span.middle)
    ends = [(math.sqrt(value) + s * near) ** 2 for value in best.values() for s in (-1.0, 1.0)]
    mses = ", ".join(f"{value:.3g} ({b})" for b, value in best.items())
    return number_claim(
        "mmt2015.mse_lugre",
        "Fig. 3",
        "MSE of LuGre fitted anew to the proposed model, widened by that model's own MSE",
        MSE_LUGRE,
        Span.of(*ends),
        assumed=(ORDER, WINDOW),
        why={
            Verdict.NOT_DETERMINED: f"least squares reach {mses} N2 against the model: no LuGre set follows the "
            "branches",
            Verdict.NOT_EXPLAINED: f"least squares reach {mses} N2 against the model: the published LuGre set is "
            "not the "
            "best one, so the comparison is unfair to LuGre",
        },
        method=Method.CO_SIMULATION,
    )


def _fig4() -> Claim:
    v = np.linspace(0.0, 18.75, 400)
    a = fig4_acceleration(v)
    as_printed = [fig4_level(x, y, MMT_FIG_4["kappa1"], 1.0) for x, y in zip(v, a, strict=True)]
    decays = [fig4_level(x, y, -MMT_FIG_4["kappa1"], s) for x, y in zip(v, a, strict=True) for s in (0.0, 1.0)]
    return statement_claim(
        "mmt2015.fig4",
        "Fig. 4",
        "lowest S with kappa1 = -0.341 in exp(-f1)",
        "1",
        "kappa1 = -0.341, and S_+v1, S_+v2 drawn as the sliding functions of positive velocity",
        {"as printed": Condition(min(as_printed), ">=", 0.0)},
        why={
            Verdict.INTERNAL_ERROR: f"a negative kappa1 makes exp(-f1) grow; with +0.341 S runs from "
            f"{min(decays):.4g} to "
            f"{max(decays):.4g}"
        },
    )


def _ranges(found: Mapping[str, Trajectory]) -> list[Claim]:
    claims = []
    for item in MOTIONS:
        run = found[item]
        window = EXPERIMENT.window(run.time)
        forces = [run.columns[f"{plant(b, e)}.F"][window] for b, e in _readings()]
        claims.append(
            open_claim(
                f"mmt2015.range_{item[-1]}",
                item,
                f"range of F in {item}, |S|, all readings",
                "the axes are not legible in our copy, and the order of the pull branches is not settled; extremes "
                "of the "
                f"readings: highest {Span.of(*(f.max() for f in forces))}, lowest "
                f"{Span.of(*(f.min() for f in forces))}",
                ours=Span.of(*(e for f in forces for e in (f.min(), f.max()))),
                unit="N",
                assumed=(ORDER, SIGN),
                method=Method.CO_SIMULATION,
            )
        )
    return claims


def _fit_error(item: str) -> Claim:
    prints = [MSE[item], ERROR] if item == "Fig. 6" else [MSE[item]]
    quantity = (
        "mean square error of the proposed model, and error peak to peak" if item == "Fig. 6" else "mean square error"
    )
    return open_claim(f"mmt2015.error_{item[-1]}", item, quantity, MEASURED, prints=prints)


def _prepared(found: Mapping[str, Trajectory], item: str) -> Claim:
    run = found[item]
    true = run.columns[f"{plant('printed', 'Eqs (10)-(12)')}.F"]
    scored = run.time >= CYCLE
    off = left(MODEL, "published", run.time, run.columns["encoder.y"], true, scored=scored)
    limit = MSE[item].span.hi
    inside = [f"{f:g}" for f, value in off.items() if value <= limit]
    return statement_claim(
        f"mmt2015.prepared_{item[-1]}",
        (item, "Section 4.2"),
        f"MSE that encoder, filtfilt and numerical differentiation alone make, motion of {item}",
        "N2",
        f"MSE = {MSE[item].text}, with 'numerical differentiation' and 'zero-phase digital filtering with filtfilt'",
        {f"{f:g} Hz": Condition(value, "<=", limit) for f, value in off.items()},
        kind=Kind.MEASUREMENT,
        assumed=(CUTOFF,),
        why={
            Verdict.NOT_DETERMINED: f"so small an MSE leaves cut-offs of {', '.join(inside)} Hz: the sign of the "
            "acceleration, which switches branches, is lost in noise above and in delay below",
            Verdict.CONSISTENT: f"at any of these cut-offs the preparation makes at most {max(off.values()):.2g} N2",
        },
        method=Method.CO_SIMULATION,
    )


def _unique(found: Mapping[str, Recovery]) -> list[Claim]:
    noise = Open("noise", f"{found['set'].trial.noise:.3f} N rms", "the reported MSE of 0.027 N2")
    return [
        recovery_claim(
            "mmt2015.reading_unique",
            ("Fig. 6", "Fig. 7", "Eqs (5)-(12)"),
            "'An efficient identification method (Genetic Algorithm) is applied to generate the optimal model "
            "parameters'",
            found["set"],
            kind=Kind.READING,
            assumed=(noise,),
            text="rho, S and 1/sigma0 can be multiplied by any factor without a change of F: one of the 13 is idle",
        ),
        recovery_claim(
            "mmt2015.reading_unique_lugre",
            "Fig. 3",
            "'Six model parameters are simultaneously optimized using Genetic Algorithm'",
            found["LuGre"],
            kind=Kind.READING,
            assumed=(noise,),
        ),
    ]


def _bent_less(found: Mapping[str, Trajectory]) -> Claim:
    errors = {}
    for motion in ("periodic", "non_periodic"):
        run = found[f"modified_lugre.{DRIVEN}{motion}.levels_110"]
        errors[motion] = float(np.ptp(run.columns["error.y"][run.time >= CYCLE]))
    return open_claim(
        "mmt2015.bent_less",
        ("Fig. 7", "Fig. 6"),
        "error of the estimated T_out, peak to peak, in a sheath bent so that it has 10 % less friction",
        f"'no change of the accumulated curve angles' is required and no tolerance printed: 10 % cost as much as the "
        f"whole reported error of {ERROR.text} N",
        ours=Span.of(*errors.values()),
        unit="N",
        assumed=(Open("spring and pretension", "400 N/m, 18 N", "not printed; they cancel in the error"),),
        method=Method.CO_SIMULATION,
    )


def _baseline(found: Mapping[str, Trajectory]) -> Claim:
    run = found[f"modified_lugre.{DRIVEN}periodic.lugre"]
    scored, force = run.time >= CYCLE, run.columns["plant.F"]
    x, v = R * run.columns["motor.phi"], run.columns["motor.omega"]
    off = lumped(Rubbed(run.time, x, v, run.columns["load.tau"] / R, force, scored))
    mse_left = {"LuGre, published": float(np.mean(run.columns["error.y"][scored] ** 2))}
    mse_left |= {masses: float(np.mean(residual**2)) for masses, residual in off.items()}
    limit = MSE["Fig. 6"].span.hi
    return statement_claim(
        "mmt2015.baseline",
        "Fig. 3",
        "MSE of LuGre and of lumped masses with Coulomb friction at their best on the proposed model's force",
        "N2",
        "'the proposed model gives a better estimation of the friction force than that available in the current "
        f"literature' (MSE {MSE['Fig. 6'].text})",
        {name: Condition(value, ">=", limit) for name, value in mse_left.items()},
        kind=Kind.MEASUREMENT,
        assumed=(Open("far tension", "18 N and 400 N/m", "not printed; for many masses only"),),
        why={
            Verdict.CONSISTENT: "friction that follows the speed, or the tension, has no levels that follow the "
            "acceleration"
        },
        method=Method.CO_SIMULATION,
    )


def _as_printed() -> list[Claim]:
    p = kernel(MODEL).params("published")
    stop, where = 10.0, "Eqs (5)-(12)"
    times = {
        f"{equation}, {name}": Condition(blow_up(equation, parts, stop), ">=", stop)
        for name, parts in (("periodic", PERIODIC), ("non-periodic", NON_PERIODIC))
        for equation in EQUATIONS
    }
    rest = p.rho2 - abs(p.mu3)
    escape = escape_time(rest, p.rho, 1.0, 1.05)
    opposite = min(
        abs(signed_level(p, -v, a, s) - signed_level(p._replace(mu3=-p.mu3), -v, a, s))
        for v in (0.3, 1.0)
        for a in (0.2, 1.5)
        for s in (-1.0, 1.0)
    )
    text = abs(p.mu3 * math.exp(-p.kappa4 * 1.0))
    signed = abs(signed_level(p, -0.3, 0.0, 1.0) - signed_level(p, -0.3, 0.0, -1.0))
    size = abs(sliding_level(p, -0.3, 0.0, 1.0) - sliding_level(p, -0.3, 0.0, -1.0))
    return [
        statement_claim(
            "mmt2015.literal",
            where,
            f"time until zeta is lost to infinity in a run of {stop:g} s, equations and numbers as printed",
            "s",
            "the identified set predicts F for both motions (Figs 6, 7)",
            times,
            why={
                Verdict.INTERNAL_ERROR: f"rho2 < |mu3| makes S as low as {rest:.4f}; from there zeta escapes within "
                f"{escape:.4f} s at 1 rad/s; |S| is the reading that works"
            },
        ),
        statement_claim(
            "mmt2015.eq9",
            where,
            "least difference between S of Eq. (9) and of Eqs (10), (11)",
            "1",
            "'The function S_-v contains three sub-functions': Eqs (10)-(12) are those of Eq. (9)",
            {"v < 0": Condition(opposite, "<=", 1e-12)},
            why={Verdict.INTERNAL_ERROR: "the signs of mu3 are opposite; the three explicit equations are used here"},
        ),
        statement_claim(
            "mmt2015.zero_acceleration",
            where,
            "S at zero acceleration: jump between Eqs (10) and (11) at 0.3 rad/s, and text against Eq. (12) at 1 rad/s",
            "1",
            "'At zero acceleration, these functions become S_-v1 = S_-v2 = S_-v0', 'a smooth transition'",
            {
                "Eqs (10), (11)": Condition(signed, "<=", 1e-9),
                "|S|": Condition(size, "<=", 1e-9),
                "text, Eq. (12)": Condition(text, "<=", 1e-9),
            },
            why={Verdict.INTERNAL_ERROR: "three values for one place; F, an integral over S, stays continuous"},
        ),
    ]
