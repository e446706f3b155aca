"""Draw ``docs/_static/readme.svg``: ``python build_scripts/make_readme_picture.py``."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

import tsm_fmu as tsm

OUT = Path(__file__).parents[1] / "docs" / "_static" / "readme.svg"
CASES = {
    "periodic.uncompensated": "without",
    "periodic.law_1": "compensated",
    "periodic.b065_law_1": "compensated, B = 0.65",
}


def main() -> None:
    """Fit the sample log, run the paper's loop, draw both."""
    mpl.rcParams |= {"svg.hashsalt": "tsm-fmu", "svg.fonttype": "none", "font.size": 9}
    figure = Figure(figsize=(9.0, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    run = tsm.sample("multisine").window(2.5)
    model = tsm.identify("PairedTsmBacklash", tsm.sample("sine").window(0.5), holdout=run)
    replay = tsm.simulate(model, run)
    x = np.degrees(run.columns["x_in"])
    sides = (
        ("measured, held out", run.columns["x_out"], "#8a949c", 2.4),
        ("fitted on another run", replay["x_out"], "#0b5cad", 0.9),
    )
    for label, angle, colour, width in sides:
        lost = np.degrees(angle - model.parameters["x_0"]) - model.parameters["c"] * x
        left.plot(x, lost, color=colour, lw=width, label=label)
    left.set(
        xlabel="drive angle [deg]", ylabel="distal angle less c x drive angle [deg]", title="lost motion, sample log"
    )
    loop = tsm.run("mssp_feedforward", case=list(CASES), stop=12.0)
    for (case, label), colour in zip(CASES.items(), ("#d1495b", "#2a8f5b", "#0b5cad"), strict=True):
        cell = next(c for c in loop.to_frame(case).columns if c.startswith("error."))
        error = loop.to_frame(case)[cell]
        right.plot(error.index, np.degrees(error), color=colour, lw=1.0, label=label)
    right.set(xlabel="time [s]", ylabel="tracking error [deg]", title="MSSP 2015, co-simulated FMUs", ylim=(-6.5, 9.5))
    for axes in (left, right):
        axes.grid(alpha=0.3)
        axes.legend(fontsize=7, loc="upper left")
    figure.savefig(OUT, metadata={"Date": None})


if __name__ == "__main__":
    main()
