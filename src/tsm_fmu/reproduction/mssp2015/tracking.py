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
from .completion import (
    BANDWIDTHS,
    EXPERIMENT,
    MAP,
    NAMES,
    SHORT,
    Completion,
    Fit,
    Line,
    described,
    fitted,
    mapped,
    published,
    worst,
)
from .printed import IDENTIFIED, MOTIONS, RESIDUAL, TABLES, TRACKED, TRACKING, WIDTH

CONTROLLER = Open("controller bandwidth", "30 to 300 rad/s", "assumed: Section 6 prints a controller without numbers")
LAG = Open("lag of the drive", "0 to 40 ms", "assumed: nothing is printed on filters, bus or speed loop")
SLOPE = Open("B of the plant", "0.05 to 1", "assumed: the published 0.08363 cannot be the rig's, see Eq. (8)")
RATE = Open("alpha of the plant", "2 to 12 1/rad", "as for B")
GAIN = Open("c of the plant", "0.95 to 1.05", "assumed: 5 % about the identified 1.00056")
QUICK = {"crossover": (60.0,), "lag": (0.03,)}
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
    published, own : dict
        Best sets by bandwidth: published numbers in the compensator, or those of the plant.
    still : Fit
        Best set of a drive without lag and of the highest bandwidth.
    about_fit, about_print : dict
        The eight numbers along each unknown, about the best set and about the published one as plant.
    """

    published: Mapping[float, Fit]
    own: Mapping[float, Fit]
    still: Fit
    about_fit: Mapping[str, Line]
    about_print: Mapping[str, Line]

    @property
    def best(self) -> Fit:
        """The set that comes nearest to all eight numbers, published compensator."""
        return nearest(self.published)


def nearest(fits: Mapping[float, Fit]) -> Fit:
    """The one that comes nearest to all eight numbers."""
    return min(fits.values(), key=lambda fit: fit.worst)


def tracked(quick: bool) -> Tracking:
    """Fit and map; ``quick`` takes fewer points and rounds."""
    bandwidths = BANDWIDTHS[-1:] if quick else BANDWIDTHS
    starts = {(own, w): published(crossover=w, own=own) for own in (False, True) for w in bandwidths}
    experiment = SHORT if quick else EXPERIMENT
    effort = {"corrections": 1, "population": 3} if quick else {"corrections": 6, "population": 10}
    still = published(crossover=bandwidths[-1], still=True)
    found = fitted([*starts.values(), still], **effort, experiment=experiment)
    fits = dict(zip(starts, found, strict=False))
    law, own_law = ({w: fits[own, w] for w in bandwidths} for own in (False, True))
    best, points = nearest(law).completion, QUICK if quick else MAP
    drive = ("crossover", "lag")
    lines = mapped(
        [(best, name, values) for name, values in points.items()] + [(published(), n, points[n]) for n in drive],
        experiment,
    )
    about_fit = dict(zip(points, lines, strict=False))
    return Tracking(law, own_law, found[-1], about_fit, dict(zip(drive, lines[len(points) :], strict=True)))


def tracking_claims(found: Tracking) -> list[Claim]:
    """One row for all numbers at once, one for each alone, and the readings that the fit excludes."""
    return [*_together(found), *_readings(found), *_alone(found)]


def _together(found: Tracking) -> list[Claim]:
    fit = found.best
    sets = [numbers for line in found.about_print.values() for _, numbers in line]
    closest = min(sets, key=worst)
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
            closest,
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
    return [_bandwidth(found), *_excluded(found)]


def _bandwidth(found: Tracking) -> Claim:
    misses = {f"{w:g} rad/s": Condition(fit.worst, "<=", 1.0) for w, fit in found.published.items()}
    sets = "; ".join(described(fit.completion) for fit in found.published.values() if fit.worst <= 1.0)
    return statement_claim(
        "mssp2015.reading_bandwidth",
        tuple(TRACKING.values()),
        f"{MISS}, best set at each controller bandwidth",
        "1",
        PRINTED,
        misses,
        kind=Kind.READING,
        assumed=(GAIN, SLOPE, RATE, LAG, WINDOW),
        why={
            Verdict.CONSISTENT: f"the eight numbers do not tell the bandwidth; sets: {sets}",
            Verdict.NOT_DETERMINED: f"the eight numbers exclude the other bandwidths; sets: {sets}",
        },
        method=Method.CO_SIMULATION,
    )


MISS = "largest miss of the eight numbers over half their print"
PRINTED = "; ".join(f"{TRACKED[n].text}" for n in NAMES if n.endswith(("width", "residual"))) + " deg"


def _excluded(found: Tracking) -> list[Claim]:
    own = nearest(found.own)
    readings = {
        "own": (own, (LAG, CONTROLLER), "the compensator has the numbers of the plant, at any controller bandwidth"),
        "still": (found.still, (), "the drive follows its command exactly"),
    }
    return [
        statement_claim(
            f"mssp2015.reading_{name}",
            TRACKING["periodic"],
            f"{MISS}, if {reading}",
            "1",
            PRINTED,
            {"best set": Condition(fit.worst, "<=", 1.0)},
            kind=Kind.READING,
            assumed=(GAIN, SLOPE, RATE, *free, WINDOW),
            why=dict.fromkeys(Verdict, f"best: {described(fit.completion)}"),
            method=Method.CO_SIMULATION,
        )
        for name, (fit, free, reading) in readings.items()
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
    """What each unknown does to the four peak-to-peak errors, the others at the best set; the miss by bandwidth."""
    shown = {
        f"{motion}.{what}": f"{motion.replace('_', '-')}, {what}"
        for motion in MOTIONS
        for what in ("width", "residual")
    }
    bands = [(f"printed: {p.text} deg", *p.span.ends) for m in MOTIONS for p in (WIDTH[m], RESIDUAL[m])]
    maps = [
        plot(
            [Drawn(label, [v for v, _ in line], [n[key] for _, n in line]) for key, label in shown.items()],
            f"Map: {LABELS[name]}",
            LABELS[name],
            "error, peak to peak [deg]",
            bands=bands,
        )
        for name, line in found.about_fit.items()
    ]
    laws = {"published numbers in the compensator": found.published, "those of the plant": found.own}
    misses = plot(
        [Drawn(name, list(fits), [fit.worst for fit in fits.values()]) for name, fits in laws.items()],
        "Best set at each bandwidth",
        LABELS["crossover"],
        "largest miss / half a print",
        bands=[("all eight as printed", 0.0, 1.0)],
    )
    return misses, *maps


def fit_table(found: Tracking) -> Table:
    """The eight numbers as printed and with the best sets, and what these are."""
    own = nearest(found.own)
    columns: dict[str, tuple[Completion, Mapping[str, float]]] = {
        **{f"{w:g} rad/s": (fit.completion, fit.numbers) for w, fit in found.published.items()},
        f"own compensator, {own.completion.crossover:g} rad/s": (own.completion, own.numbers),
        "exact drive": (found.still.completion, found.still.numbers),
        "published plant": (published(), found.about_print["crossover"][-1][1]),
    }
    rows = [
        [
            f"{name.replace('.', ', ').replace('_', '-')} [deg]",
            TRACKED[name].text,
            *(f"{numbers[name]:.4g}" for _, numbers in columns.values()),
        ]
        for name in NAMES
    ]
    rows += [
        ["largest miss / half a print", "1", *(f"{worst(numbers):.3g}" for _, numbers in columns.values())],
        ["c of the plant", "", *(f"{at.c:.4f}" for at, _ in columns.values())],
        ["B of the plant", "", *(f"{at.B:.3f}" for at, _ in columns.values())],
        ["alpha of the plant [1/rad]", "", *(f"{at.alpha:.2f}" for at, _ in columns.values())],
        ["lag of the drive [ms]", "", *(f"{1e3 * at.lag:.1f}" for at, _ in columns.values())],
    ]
    return Table(
        ["", "printed", *columns],
        rows,
        "Co-simulated; the best set that was found for each column, by controller bandwidth with the published "
        "numbers in the compensator.",
    )
