"""Every figure and table of the five papers, and the places in the text that carry a claim.

An item either has claims (their modules name its label) or says here why it has none. What is printed is in each
paper's ``printed``.
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


class Item(NamedTuple):
    """A figure, table, equation or section; ``no_claim`` is the reason where nothing can be compared."""

    paper: str
    label: str
    shows: str
    no_claim: str = ""


SKETCH = "sketch without a scale"
RIG = "photograph or drawing of the rig"
BLOCKS = "block diagram; the loop itself is compared in the figures of its results"

ITEMS = (
    Item("iftomm2013", "Fig. 1", "tendon in a sheath, its hysteresis in words", SKETCH),
    Item("iftomm2013", "Fig. 2", "experimental setup", RIG),
    Item("iftomm2013", "Fig. 3", "measured friction of two shapes of the sheath, 540 deg in all"),
    Item("iftomm2013", "Fig. 4", "model and measurement, friction loops"),
    Item("iftomm2013", "Eq. (1)", "sliding force and its 12 numbers"),
    Item("iftomm2013", "Eq. (2)", "the state equation"),
    Item("iftomm2013", "Prop. 1", "existence and uniqueness"),
    Item("iftomm2013", "Prop. 2", "bounded input, bounded output"),
    Item("iftomm2013", "Prop. 3", "dissipativity"),
    Item("icinco2013", "Fig. 1", "overview of a surgical system", SKETCH),
    Item("icinco2013", "Fig. 2", "experimental setup: motor and gear"),
    Item("icinco2013", "Fig. 3", "measured tensions at 1 and 0.8 Hz"),
    Item("icinco2013", "Fig. 4", "one element with friction", SKETCH),
    Item("icinco2013", "Fig. 5", "nonlinear characteristics of the friction, phases marked", SKETCH),
    Item("icinco2013", "Fig. 6", "model and measurement at 1 Hz"),
    Item("icinco2013", "Fig. 7", "model and measurement at 0.8 Hz"),
    Item("icinco2013", "Table 1", "11 identified parameters"),
    Item("icinco2013", "Eq. (1)", "force balance of the tendon"),
    Item("icinco2013", "Section 3.1", "sliding force at zero acceleration"),
    Item("icinco2013", "Section 3.2", "steady state and smoothness of the internal variable"),
    Item("mmt2015", "Fig. 1", "tendon-sheath mechanism and its friction", SKETCH),
    Item("mmt2015", "Fig. 2", "bristle of the LuGre model, from the literature", SKETCH),
    Item("mmt2015", "Fig. 3", "LuGre model against measurement, MSE 1.4538"),
    Item("mmt2015", "Fig. 4", "sliding functions for v >= 0"),
    Item("mmt2015", "Fig. 5", "experimental setup", RIG),
    Item("mmt2015", "Fig. 6", "periodic motion: model against measurement, MSE 0.027"),
    Item("mmt2015", "Fig. 7", "non-periodic motion: model against measurement, MSE 0.0419"),
    Item("mmt2015", "Fig. 8", "measured friction of two shapes of the sheath, 540 deg in all"),
    Item("mmt2015", "Section 4.2", "filtering and differentiation of the measured signals"),
    Item("mmt2015", "Eqs (5)-(12)", "the state equation and its sliding level with the identified set"),
    Item("mssp2015", "Fig. 1", "endoscopic system", SKETCH),
    Item("mssp2015", "Fig. 2", "pair of tendon-sheath mechanisms", SKETCH),
    Item("mssp2015", "Fig. 3", "backlash-like loop and friction over speed, phases marked", SKETCH),
    Item("mssp2015", "Fig. 4", "schematic of the setup", RIG),
    Item("mssp2015", "Fig. 5", "photograph of the setup", RIG),
    Item("mssp2015", "Fig. 6", "control scheme with feedforward", BLOCKS),
    Item("mssp2015", "Fig. 7", "identification, periodic motion"),
    Item("mssp2015", "Fig. 8", "identification, non-periodic motion"),
    Item("mssp2015", "Fig. 9", "force feedback structure"),
    Item("mssp2015", "Fig. 10", "tracking of the periodic motion, without and with feedforward"),
    Item("mssp2015", "Fig. 11", "friction of the periodic motion"),
    Item("mssp2015", "Fig. 12", "tracking of the non-periodic motion"),
    Item("mssp2015", "Fig. 13", "friction of the non-periodic motion"),
    Item("mssp2015", "Table 1", "five trials, periodic motion: mean error and standard deviation"),
    Item("mssp2015", "Table 2", "five trials, non-periodic motion"),
    Item("mssp2015", "Eq. (8)", "Coleman-Hodgdon model: monotone between extrema"),
    Item("mssp2015", "Eq. (24)", "the feedforward law removes the error"),
    Item("mssp2015", "Section 5", "number of identified parameters"),
    Item("mssp2015", "Section 9", "friction compensation and backlash"),
    Item("ame2020", "Fig. 1", "the device in an MRI scanner", SKETCH),
    Item("ame2020", "Fig. 2", "wheels with LeBus grooves"),
    Item("ame2020", "Fig. 3", "coordinates of the winding, Eq. (4)"),
    Item("ame2020", "Fig. 4", "second layer on the first, Eqs (10)-(13), (24)"),
    Item("ame2020", "Fig. 5", "forces on a piece of tendon", SKETCH),
    Item("ame2020", "Fig. 6", "sheath with several bends", SKETCH),
    Item("ame2020", "Fig. 7", "double tendon-sheath transmission", SKETCH),
    Item("ame2020", "Fig. 8", "rig for the pretension", RIG),
    Item("ame2020", "Fig. 9", "preloads of the tensioning pulley"),
    Item("ame2020", "Fig. 10", "mean displacement difference over preload"),
    Item("ame2020", "Fig. 11", "three-point force measurement"),
    Item("ame2020", "Fig. 12", "experimental setup; tendon data"),
    Item("ame2020", "Fig. 13", "forward trajectories, theory and experiment"),
    Item("ame2020", "Fig. 14", "reverse trajectories, theory and experiment"),
    Item("ame2020", "Fig. 15", "one cycle, four cases"),
    Item("ame2020", "Fig. 16", "forward displacement error, four cases"),
    Item("ame2020", "Fig. 17", "reverse displacement error, four cases"),
    Item("ame2020", "Fig. 18", "two loads at the same bend"),
    Item("ame2020", "Fig. 19", "compensation, 0.5 kg and 180 deg"),
    Item("ame2020", "Fig. 20", "compensation, 1 kg and 540 deg"),
    Item("ame2020", "Table 1", "calibration of the preload, Eq. (37)"),
    Item("ame2020", "Eq. (40)", "LuGre model and its parameters"),
)
