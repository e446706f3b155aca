"""AME 2020, Eq. (40): its LuGre set as an identification would find it again from its own stroke, there and back."""

from __future__ import annotations

from ...cosim.system import Experiment
from ...scenarios.lebus_drive import RADIUS, SPEED, STROKE
from ..claims import Claim, Open
from ..loops import co_simulate
from ..motions import driven
from ..recovery import Motion, Recovery, Trial, recovered, recovery_claim
from ..verdict import Kind

NAMES = ("sigma0", "sigma1", "sigma2", "F_c", "v_s")
"""Identified parameters, with F_c for mu_s; the published set has no Stribeck peak."""
NOISE_N = 0.05
TURN = STROKE / SPEED


def identified(quick: bool) -> Recovery:
    """Identify the set again from the friction of half a second before and after the turn of the stroke."""
    stroke = {"kind": 2, "speed": SPEED * RADIUS, "stroke": STROKE * RADIUS, "cycles": 1.0}
    runs = co_simulate({"lugre": driven("LuGreFriction", stroke, Experiment(stop=TURN + 2.0, step=2e-3), "published")})
    window = (TURN - 0.5, TURN + 0.5)
    motion = Motion(runs["lugre"], {"v": ("reference.dy", 1.0)}, "plant.F", window)
    trial = Trial("LuGreFriction", "published", "F", (motion,), NAMES, NOISE_N, 4e-3)
    return recovered({"lugre": trial}, quick)["lugre"]


def identified_claim(found: Recovery) -> Claim:
    """Row on the identification that the paper names."""
    return recovery_claim(
        "ame2020.reading_unique",
        "Eq. (40)",
        "'The parameters of the LuGre model can be identified from the experimental data using the least-squares "
        "method and a genetic algorithm'",
        found,
        kind=Kind.READING,
        assumed=(
            Open("noise", f"{NOISE_N:g} N rms", "assumed: 1 % of the load"),
            Open("motion", "the stroke of Fig. 15, 0.05 m/s", "the data of the identification are not published"),
        ),
        text="at one speed the bristles, 8 um of presliding, and the Stribeck curve leave no trace in the rows",
    )
