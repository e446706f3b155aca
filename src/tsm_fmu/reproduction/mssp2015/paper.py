"""MSSP 2015: backlash-like hysteresis, feedforward law and friction of a pair of tendons."""

from __future__ import annotations

from ..recovery import recovery_table
from ..result import PaperResult
from . import imposed
from .equations import equation_claims
from .figures import friction_figures, identified_figures, traces, tracking_figures
from .friction import friction_claims, frictionless, haptic_runs
from .identified import identified, identified_claims
from .printed import FRICTION, IDENTIFIED, MOTIONS, TRACKING
from .tracking import fit_table, map_figures, tracked, tracking_claims


def result(quick: bool = False) -> PaperResult:
    """All claims and figures; ``quick`` takes fewer points of what is open."""
    found = tracked(quick)
    best = found.best.completion
    runs, haptic, drawn = imposed.runs(), haptic_runs(best, quick), traces(best, quick)
    sets = identified(runs, quick)
    claims = [
        *tracking_claims(found),
        *equation_claims(runs),
        *friction_claims(runs, haptic, frictionless(best)),
        *identified_claims(sets),
    ]
    figures = {TRACKING[m]: tracking_figures(drawn, m) for m in MOTIONS}
    figures["Fig. 10"] += map_figures(found)
    figures |= {IDENTIFIED[m]: identified_figures(runs[m]) for m in MOTIONS}
    figures |= {FRICTION[m]: friction_figures(haptic, m) for m in MOTIONS}
    tables = {"Fig. 10": fit_table(found), "Fig. 7": recovery_table(sets["friction"])}
    tables["Fig. 8"] = recovery_table(sets["backlash"])
    return PaperResult(tuple(claims), figures, tables, {"Fig. 10": TEXT})


TEXT = (
    "Every number here is from a closed loop of FMUs: reference, compensator, PID, motor with the gear 134:1 that "
    "ICINCO 2013 prints for it, backlash, friction, load, and the follower's encoder. The paper prints one backlash "
    "set and no controller. With that set as the plant the law leaves twice the error that was measured. The table "
    "says which plant and drive give all eight reported numbers at once at each controller bandwidth, if any do, the "
    "first plot how near the best set comes; the four maps say what each unknown does, the others held at the best."
)
