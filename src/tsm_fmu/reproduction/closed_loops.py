"""MSSP 2015 Figs 10 and 12 again, as FMUs in closed loop with motor, controller, friction and load."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..cosim.cases import chosen, run_cases, statistics
from ..fmu.build import build_fmu
from ..kernels.kernel import kernel
from ..scenarios import mssp_feedforward
from ..scenarios.papers import TRIALS
from .claims import Claim, Verdict, number_claim
from .mssp2015.paper import SUFFIX, TABLES, TRACKING
from .numbers import REPORTED, trials

VARIANTS = ("uncompensated", "law_1")


def closed_loop_claims(*, progress: bool = False) -> list[Claim]:
    """Claims on the tracking errors from co-simulated loops; about 4 s a case.

    Parameters
    ----------
    progress : bool
        Show a bar on stderr, if that is a terminal.
    """
    with TemporaryDirectory(prefix="tsm_fmu_reproduce_") as folder:
        fmus = {model: build_fmu(kernel(model), Path(folder)) for model in mssp_feedforward.FMUS}
        names = [f"{motion}.{variant}" for motion in TRACKING for variant in VARIANTS]
        cases = chosen(mssp_feedforward.cases(fmus), names)
        metrics = statistics(cases, run_cases(cases, record=["error.y"], progress=progress))
    return [claim for motion in TRACKING for claim in _claims(motion, metrics[motion])]


def _claims(motion: str, found: dict[str, Any]) -> list[Claim]:
    table, columns = TABLES[motion], TRIALS[motion]
    same = {
        Verdict.REPRODUCED: "motor and controller add their tracking error to that of the backlash",
        Verdict.CONTRADICTS: "the loop does not change what the equations leave",
    }
    item = TRACKING[motion]
    return [
        number_claim(
            f"mssp2015.loop_{motion}_width",
            item,
            "closed loop without feedforward, error peak to peak",
            REPORTED["mssp2015.width" + SUFFIX[motion]],
            found["uncompensated"]["peak_to_peak_deg"],
            same,
        ),
        number_claim(
            f"mssp2015.loop_{motion}_residual",
            item,
            "closed loop with feedforward, error peak to peak, published plant",
            REPORTED["mssp2015.residual" + SUFFIX[motion]],
            found["law_1"]["peak_to_peak_deg"],
            same,
        ),
        number_claim(
            f"mssp2015.loop_{motion}_std",
            table,
            "closed loop with feedforward, standard deviation, published plant",
            trials("position, standard deviation", columns["position_std_deg"], "deg", table),
            found["law_1"]["std_deg"],
            same,
        ),
    ]
