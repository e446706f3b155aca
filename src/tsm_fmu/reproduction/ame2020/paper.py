"""AME 2020: the LeBus drive with its tendon, wheel, preload and displacement errors."""

from __future__ import annotations

from ..recovery import recovery_table
from ..result import PaperResult
from .compensated import PAIR, residual_table
from .displacement import displacement_claims, found
from .figures import calibration_figure, displacement_figures, preload_figure, winding_figure
from .lugre import identified, identified_claim
from .tendon import preload_runs, tendon_claims
from .wheel import groove_table, wheel_claims


def result(quick: bool = False) -> PaperResult:
    """All claims and figures; ``quick`` takes fewer points of what is open."""
    f, preloaded, lugre = found(quick), preload_runs(), identified(quick)
    return PaperResult(
        (*wheel_claims(), *tendon_claims(preloaded), *displacement_claims(f), identified_claim(lugre)),
        {
            "Fig. 3": winding_figure(),
            "Fig. 10": preload_figure(preloaded),
            "Table 1": calibration_figure(),
            **displacement_figures(f),
        },
        {
            "Fig. 3": groove_table(),
            "Eq. (40)": recovery_table(lugre),
            **{item: residual_table(f.runs, item) for item in PAIR},
        },
        {"Fig. 16": TEXT},
    )


TEXT = (
    "The drive is a loop of FMUs: ramp, stepper motor, wheel with its friction, transmission, and the weight that "
    "loads the follower. Errors are commanded minus followed tendon."
)
