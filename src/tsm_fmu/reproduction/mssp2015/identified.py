"""MSSP 2015, Section 5: its two published sets as its GA and simplex would find them again, both motions."""

from __future__ import annotations

from collections.abc import Mapping

from ...cosim.trajectory import Trajectory
from ..claims import Claim, Open
from ..recovery import Motion, Recovery, Trial, recovered, recovery_claim
from ..verdict import Kind
from .completion import COUNT
from .friction import radius, reported_deviation
from .printed import IDENTIFIED, MOTIONS

STATES = "'the obtained model parameters will be used as an initial guess in the Nelder-Mead Simplex method'"
NAMES = {
    "friction": ("rho", "lambda", "sigma", "n", "k_x", "k_zeta", "upsilon", "F_0"),
    "backlash": ("c", "beta", "alpha"),
}


def identified(runs: Mapping[str, Trajectory], quick: bool) -> dict[str, Recovery]:
    """Identify both sets again from the runs of their FMUs."""
    force = reported_deviation() * 1e3 * radius()  # F as printed, read as N.mm
    moved = {"x": ("reference.y", 1.0), "v": ("reference.dy", 1.0), "a": ("reference.ddy", 1.0)}
    return recovered(
        {
            "friction": Trial(
                "PairedTsmFriction", "raw", "F", _motions(runs, moved, "friction.F"), NAMES["friction"], force, 2e-2,
                encoder=COUNT, genetic_s=2.5,
            ),
            "backlash": Trial(
                "PairedTsmBacklash", "published", "x_out",
                _motions(runs, {"x_in": ("reference.y", 1.0)}, "backlash.x_out"), NAMES["backlash"], COUNT, 2e-2,
            ),
        },
        quick,
    )  # fmt: skip


def _motions(runs: Mapping[str, Trajectory], inputs: Mapping[str, tuple[str, float]], output: str) -> list[Motion]:
    return [Motion(runs[motion], inputs, output, (0.0, 10.0)) for motion in MOTIONS]


def identified_claims(found: Mapping[str, Recovery]) -> list[Claim]:
    """One row a set."""
    noise = {
        "friction": Open("noise", "5.6, as printed", "the reported deviation of 0.224 N on the 25 mm pulley, as N.mm"),
        "backlash": Open("noise", "0.025 deg", "a count of the printed encoder"),
    }
    return [
        recovery_claim(
            f"mssp2015.reading_unique_{name}",
            ("Section 5", *IDENTIFIED.values()),
            STATES,
            recovery,
            kind=Kind.READING,
            assumed=(noise[name],),
        )
        for name, recovery in found.items()
    ]
