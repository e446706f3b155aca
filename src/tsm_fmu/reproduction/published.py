"""Every figure and table of the five papers, and the places in the text that carry a claim.

An item either has claims (their modules name its label) or stands in `NO_CLAIM` with the reason why it has none.
What is printed is in each paper's ``printed``.
"""

from __future__ import annotations

from typing import NamedTuple

PAPERS = {
    "iftomm2013": "IFToMM 2013: dynamic friction model for tendon-sheath actuated surgical robots (Do et al.)",
    "icinco2013": "ICINCO 2013: dynamic friction model in tendon sheath, parameter identification (Do et al.)",
    "mmt2015": "MMT 2015: Mech. Mach. Theory 85, a new approach of friction model (Do et al.)",
    "mssp2015": "MSSP 2015: Mech. Syst. Signal Process. 60-61, friction and compensation of a pair (Do et al.)",
    "ame2020": "AME 2020: Adv. Mech. Eng. 12, long-distance double tendon-sheath with LeBus grooves (Jia et al.)",
}


SHOWN: dict[str, dict[str, str]] = {
    "iftomm2013": {
        "Fig. 1": "tendon in a sheath, output over input tension and its phases",
        "Fig. 2": "experimental setup",
        "Fig. 3": "measured friction of two shapes of the sheath, 540 deg in all",
        "Fig. 4": "model and measurement, friction loops",
        "Eq. (1)": "sliding force and its 12 numbers",
        "Eq. (2)": "the state equation",
        "Prop. 1": "existence and uniqueness",
        "Prop. 2": "bounded input, bounded output",
        "Prop. 3": "dissipativity",
    },
    "icinco2013": {
        "Fig. 1": "overview of a surgical system",
        "Fig. 2": "experimental setup: motor and gear",
        "Fig. 3": "measured tensions at 1 and 0.8 Hz",
        "Fig. 4": "one element with friction",
        "Fig. 5": "nonlinear characteristics of the friction, phases marked",
        "Fig. 6": "model and measurement at 1 Hz",
        "Fig. 7": "model and measurement at 0.8 Hz",
        "Table 1": "11 identified parameters",
        "Eq. (1)": "force balance of the tendon",
        "Section 3.1": "sliding force at zero acceleration",
        "Section 3.2": "steady state and smoothness of the internal variable",
    },
    "mmt2015": {
        "Fig. 1": "tendon-sheath mechanism and its friction",
        "Fig. 2": "bristle of the LuGre model, from the literature",
        "Fig. 3": "LuGre model against measurement, MSE 1.4538",
        "Fig. 4": "sliding functions for v >= 0",
        "Fig. 5": "experimental setup",
        "Fig. 6": "periodic motion: model against measurement, MSE 0.027",
        "Fig. 7": "non-periodic motion: model against measurement, MSE 0.0419",
        "Fig. 8": "measured friction of two shapes of the sheath, 540 deg in all",
        "Section 4.2": "filtering and differentiation of the measured signals",
        "Eqs (5)-(12)": "the state equation and its sliding level with the identified set",
    },
    "mssp2015": {
        "Fig. 1": "endoscopic system",
        "Fig. 2": "pair of tendon-sheath mechanisms",
        "Fig. 3": "backlash-like loop and friction over speed, phases marked",
        "Fig. 4": "schematic of the setup",
        "Fig. 5": "photograph of the setup",
        "Fig. 6": "control scheme with feedforward",
        "Fig. 7": "identification, periodic motion",
        "Fig. 8": "identification, non-periodic motion",
        "Fig. 9": "force feedback structure",
        "Fig. 10": "tracking of the periodic motion, without and with feedforward",
        "Fig. 11": "friction of the periodic motion",
        "Fig. 12": "tracking of the non-periodic motion",
        "Fig. 13": "friction of the non-periodic motion",
        "Table 1": "five trials, periodic motion: mean error and standard deviation",
        "Table 2": "five trials, non-periodic motion",
        "Eq. (8)": "Coleman-Hodgdon model: monotone between extrema",
        "Eq. (24)": "the feedforward law removes the error",
        "Section 5": "number of identified parameters",
        "Section 9": "friction compensation and backlash",
    },
    "ame2020": {
        "Fig. 1": "the device in an MRI scanner",
        "Fig. 2": "wheels with LeBus grooves",
        "Fig. 3": "coordinates of the winding, Eq. (4)",
        "Fig. 4": "second layer on the first, Eqs (10)-(13), (24)",
        "Fig. 5": "forces on a piece of tendon",
        "Fig. 6": "sheath with several bends",
        "Fig. 7": "double tendon-sheath transmission",
        "Fig. 8": "rig for the pretension",
        "Fig. 9": "preloads of the tensioning pulley",
        "Fig. 10": "mean displacement difference over preload",
        "Fig. 11": "three-point force measurement",
        "Fig. 12": "experimental setup; tendon data",
        "Fig. 13": "forward trajectories, theory and experiment",
        "Fig. 14": "reverse trajectories, theory and experiment",
        "Fig. 15": "one cycle, four cases",
        "Fig. 16": "forward displacement error, four cases",
        "Fig. 17": "reverse displacement error, four cases",
        "Fig. 18": "two loads at the same bend",
        "Fig. 19": "compensation, 0.5 kg and 180 deg",
        "Fig. 20": "compensation, 1 kg and 540 deg",
        "Table 1": "calibration of the preload, Eq. (37)",
        "Eq. (40)": "LuGre model and its parameters",
    },
}
"""By paper and label: what the item shows."""

SKETCH = "sketch without a scale"
RIG = "photograph or drawing of the rig"
BLOCKS = "block diagram; the loop itself is compared in the figures of its results"

NO_CLAIM: dict[str, dict[str, str]] = {
    "iftomm2013": {
        "Fig. 2": RIG,
    },
    "icinco2013": {
        "Fig. 1": SKETCH,
        "Fig. 4": SKETCH,
    },
    "mmt2015": {
        "Fig. 1": SKETCH,
        "Fig. 2": SKETCH,
        "Fig. 5": RIG,
    },
    "mssp2015": {
        "Fig. 1": SKETCH,
        "Fig. 2": SKETCH,
        "Fig. 3": SKETCH,
        "Fig. 4": RIG,
        "Fig. 5": RIG,
        "Fig. 6": BLOCKS,
    },
    "ame2020": {
        "Fig. 1": SKETCH,
        "Fig. 5": SKETCH,
        "Fig. 6": SKETCH,
        "Fig. 7": SKETCH,
        "Fig. 8": RIG,
    },
}
"""By paper and label: why nothing can be compared."""


class Item(NamedTuple):
    """A figure, table, equation or section; ``no_claim`` is the reason where nothing can be compared."""

    paper: str
    label: str
    shows: str
    no_claim: str = ""


ITEMS = tuple(
    Item(paper, label, shows, NO_CLAIM[paper].get(label, ""))
    for paper, items in SHOWN.items()
    for label, shows in items.items()
)
