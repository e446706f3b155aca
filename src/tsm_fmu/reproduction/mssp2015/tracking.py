"""MSSP 2015, Figs 10 and 12, Tables 1 and 2: tracking errors from loops of FMUs over all that the paper leaves open.

Each printed number alone can be had from some controller, lag or plant; only all eight at once are a test.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ...report import Figure, Table
from ...report import Line as Drawn
from ..claims import Claim, Method, Open, number_claim, statement_claim, together_claim
from ..draw import plot
from ..verdict import Condition, Kind, Span, Verdict, number
from .completion import EXPERIMENT, MAP, NAMES, SHORT, Fit, Line, described, fitted, mapped, published, worst
from .printed import IDENTIFIED, MOTIONS, RESIDUAL, TABLES, TRACKED, TRACKING, WIDTH

CONTROLLER = Open("controller bandwidth", "30 to 300 rad/s", "assumed: Section 6 prints a controller without numbers")
LAG = Open("lag of the drive", "0 to 40 ms", "assumed: nothing is printed on filters, bus or speed loop")
SLOPE = Open("B of the plant", "0.05 to 1", "assumed: the published 0.08363 cannot be the rig's, see Eq. (8)")
RATE = Open("alpha of the plant", "2 to 12 1/rad", "as for B")
GAIN = Open("c of the plant", "0.95 to 1.05", "as for B")
QUICK = {"crossover": (60.0,), "lag": (0.03,), "B": (0.3,), "alpha": (8.0,)}
"""Of `MAP`, for tests."""
SAID = {
    "width": "error without feedforward, peak to peak",
    "residual": "error with feedforward, peak to peak",
    "std": "error with feedforward, standard deviation",
    "mean": "error with feedforward, mean",
}
LABELS = {
    "crossover": "controller bandwidth [rad/s]",
    "lag": "lag of the drive [s]",
    "B": "B of the plant",
    "alpha": "alpha of the plant [1/rad]",
}


@dataclass(frozen=True)
class Tracking:
    """What was co-simulated on tracking.

    Attributes
    ----------
    fits : dict
        Best sets: ``published`` numbers in the compensator, those of the plant (``own``), and a drive that follows
        its command exactly (``still``).
    about_fit, about_print : dict
        The eight numbers along each unknown, about the best set and about the published one as plant.
    """

    fits: Mapping[str, Fit]
    about_fit: Mapping[str, Line]
    about_print: Mapping[str, Line]


def tracked(quick: bool) -> Tracking:
    """Fit and map; ``quick`` takes fewer points and rounds."""
    starts = {"published": published(), "own": published(own=True), "still": published(still=True)}
    experiment = SHORT if quick else EXPERIMENT
    effort = {"corrections": 1, "population": 3} if quick else {"corrections": 6, "population": 10}
    fits = fitted(starts, **effort, experiment=experiment)
    best, points = fits["published"].completion, QUICK if quick else MAP
    drive = ("crossover", "lag")
    lines = mapped(
        [(best, name, values) for name, values in points.items()] + [(published(), n, points[n]) for n in drive],
        experiment,
    )
    return Tracking(fits, dict(zip(points, lines, strict=False)), dict(zip(drive, lines[len(points) :], strict=True)))


def tracking_claims(found: Tracking) -> list[Claim]:
    """One row for all numbers at once, one for each alone, and the readings that the fit excludes."""
    return [*_together(found), *_readings(found), *_alone(found)]


def _together(found: Tracking) -> list[Claim]:
    fit = found.fits["published"]
    sets = [numbers for line in found.about_print.values() for _, numbers in line]
    nearest = min(sets, key=worst)
    items = (*TRACKING.values(), *TABLES.values())
    return [
        together_claim(
            "mssp2015.together",
            items,
            "all eight tracking errors, published compensator on a plant and drive that are free",
            TRACKED,
            fit.numbers,
            assumed=(GAIN, SLOPE, RATE, LAG, CONTROLLER, WINDOW),
            why={
                Verdict.CONSISTENT: f"the rig was then {described(fit.completion)}; the compensator keeps the "
                "published numbers, which are not those of this plant",
                Verdict.NOT_EXPLAINED: f"the best set is {described(fit.completion)}: {number(fit.worst)} times half "
                "the width of a print off at most",
            },
            method=Method.CO_SIMULATION,
        ),
        together_claim(
            "mssp2015.published_plant",
            items,
            "all eight tracking errors, published numbers in plant and compensator, any controller and lag",
            TRACKED,
            nearest,
            assumed=(CONTROLLER, LAG),
            why={
                Verdict.NOT_EXPLAINED: "the published numbers leave more with feedforward than was measured, with "
                "every controller and lag: they do not describe the plant that was controlled"
            },
            method=Method.CO_SIMULATION,
        ),
    ]


WINDOW = Open("window", "5 to 40 s", "assumed: the time axes are not legible in our copy")


def _readings(found: Tracking) -> list[Claim]:
    said = {
        "own": ("the compensator has the numbers of the plant", "an exact compensator leaves the two motions alike"),
        "still": ("the drive follows its command exactly", "a plant without rate gives both motions the same width"),
    }
    return [
        statement_claim(
            f"mssp2015.reading_{name}",
            TRACKING["periodic"],
            f"largest miss of the eight numbers over half their print, if {reading}",
            "1",
            "; ".join(f"{TRACKED[n].text}" for n in NAMES if n.endswith(("width", "residual"))) + " deg",
            {"best set": Condition(found.fits[name].worst, "<=", 1.0)},
            kind=Kind.READING,
            assumed=(GAIN, SLOPE, RATE, *((LAG,) if name == "own" else ()), WINDOW),
            why={Verdict.READING_EXCLUDED: f"{why}; best: {described(found.fits[name].completion)}"},
            method=Method.CO_SIMULATION,
        )
        for name, (reading, why) in said.items()
    ]


def _alone(found: Tracking) -> list[Claim]:
    lines = [*found.about_fit.values(), *found.about_print.values()]
    everything = [numbers for line in lines for _, numbers in line]
    claims = []
    for name in NAMES:
        motion, _, what = name.partition(".")
        place = TRACKING[motion] if what in ("width", "residual") else TABLES[motion]
        items = (place, IDENTIFIED[motion]) if what == "width" else place
        claims.append(
            number_claim(
                f"mssp2015.{motion}_{what}",
                items,
                f"{SAID[what]}, {motion.replace('_', '-')} motion",
                TRACKED[name],
                Span.of(*(numbers[name] for numbers in everything)),
                assumed=(CONTROLLER, LAG, SLOPE, RATE),
                why={Verdict.NOT_DETERMINED: "alone it is no test: the span is that of the map below Fig. 10"},
                method=Method.CO_SIMULATION,
            )
        )
    return claims


def map_figures(found: Tracking) -> tuple[Figure, ...]:
    """What each unknown does to the four peak-to-peak errors, the others at the best set."""
    shown = {
        f"{motion}.{what}": f"{motion.replace('_', '-')}, {what}"
        for motion in MOTIONS
        for what in ("width", "residual")
    }
    bands = [(f"printed: {p.text} deg", *p.span.ends) for m in MOTIONS for p in (WIDTH[m], RESIDUAL[m])]
    return tuple(
        plot(
            [Drawn(label, [v for v, _ in line], [n[key] for _, n in line]) for key, label in shown.items()],
            f"Map: {LABELS[name]}",
            LABELS[name],
            "error, peak to peak [deg]",
            bands=bands,
        )
        for name, line in found.about_fit.items()
    )


def fit_table(found: Tracking) -> Table:
    """The eight numbers as printed, and with the best sets."""
    columns = {
        "best set": found.fits["published"].numbers,
        "own compensator": found.fits["own"].numbers,
        "exact drive": found.fits["still"].numbers,
        "published plant, 300 rad/s": found.about_print["crossover"][-1][1],
    }
    rows = [
        [name.replace(".", ", ").replace("_", "-"), TRACKED[name].text, *(f"{c[name]:.4g}" for c in columns.values())]
        for name in NAMES
    ]
    return Table(
        ["error [deg]", "printed", *columns], rows, "Co-simulated; the best set that was found for each column."
    )
