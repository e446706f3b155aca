"""IFToMM 2013: is its set of parameters unique, as it says? Played on a motion of its kind, lost, and found."""

from __future__ import annotations

from ...cosim.trajectory import Trajectory
from ...kernels.kernel import kernel
from ..claims import Claim, Open
from ..recovery import Motion, Recovery, Trial, recovered, recovery_claim
from ..verdict import Kind
from .printed import ERROR
from .properties import MODEL, MOTION

NOISE_N = ERROR.span.middle / 6.0
"""Normal noise whose +-3 sigma is the reported error."""


def unique(run: Trajectory, quick: bool) -> Recovery:
    """Identify reading A again from a run of its FMU."""
    names = tuple(v.name for v in kernel(MODEL).parameters if v.name != "zeta_0")
    motion = Motion(run, {"v": ("reference.dy", 1.0), "a": ("reference.ddy", 1.0)}, "plant.F", (0.0, 10.0))
    trial = Trial(MODEL, "published", "F", (motion,), names, NOISE_N, 1e-2)
    return recovered({"unique": trial}, quick)["unique"]


def unique_claim(found: Recovery) -> Claim:
    """Row on the sentence that the parameters are unique."""
    return recovery_claim(
        "iftomm2013.unique",
        ("Fig. 4", "Prop. 1"),
        "'help to ensure that the model parameters in the identification process are unique'",
        found,
        kind=Kind.MEASUREMENT,
        assumed=(Open("noise", f"{NOISE_N:.3f} N rms", "what fits into the reported 0.4 N peak to peak"), MOTION),
        text="a unique force does not make its parameters unique",
    )
