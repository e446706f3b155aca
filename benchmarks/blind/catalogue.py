"""The cases: what is hidden in which rig, how large, how it is excited, by which instruments it is seen.

Strata: A effects of the vocabulary in other functional forms, B wrong baseline parameters, C noise, encoder steps and
jitter, D two effects, E effects outside the vocabulary, F nothing missing, G effect present but not excited.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from .instruments import Instruments

STRATA = "ABCDEFG"
RICH = ("sines", "strokes")
"""Motion of the measured runs, unless an effect needs another one."""


@dataclass(frozen=True)
class Case:
    """One case.

    Attributes
    ----------
    stratum : str
    model : str
        The user's model.
    hidden : tuple of str
        Forms of `hidden.FORMS` or `outside.OUTSIDE`.
    size : float
        RMS response of each over the channel's RMS; in G on a motion that excites it.
    measured, holdout : tuple of str
        Kinds of motion, one run each.
    pace, duration, scale : float
        Speed of the motion, length of a run [s], part of the stroke used.
    turns, dip, held
        As in `plants.draw_rig`.
    wrong : tuple of str
        Parameters that the user has wrong.
    reference : bool
        Runs of the rig before the effect came are given too.
    instruments : Instruments
    seed : int
    name : str
        Folder; says nothing of the case.
    """

    stratum: str
    model: str
    hidden: tuple[str, ...] = ()
    size: float = 0.0
    measured: tuple[str, ...] = RICH
    holdout: tuple[str, ...] = ("chirp",)
    pace: float = 1.0
    duration: float = 20.0
    scale: float = 1.0
    turns: float = 0.0
    dip: bool = False
    held: bool = False
    wrong: tuple[str, ...] = ()
    reference: bool = False
    instruments: Instruments = field(default_factory=Instruments)
    seed: int = 0
    name: str = ""


NEEDS: dict[str, dict[str, object]] = {
    "late_stribeck": {"dip": True, "pace": 1.6},
    "maxwell_of_long_reach": {"measured": ("nested", "sines"), "holdout": ("nested", "chirp")},
    "straight_presliding": {"measured": ("nested", "sines"), "holdout": ("strokes",)},
    "kato_ageing": {"measured": ("strokes", "strokes"), "holdout": ("strokes",), "duration": 30.0},
    "two_bodies_warm": {"measured": ("work_rest", "sines"), "holdout": ("work_rest",), "duration": 40.0},
    "running_in": {"measured": ("work_rest", "sines"), "holdout": ("work_rest",), "duration": 40.0},
    "relaxing_sheath": {"measured": ("strokes", "chirp"), "holdout": ("strokes",)},
    "kelvin_voigt": {"measured": ("strokes", "chirp"), "holdout": ("strokes",)},
    "eccentric_bearing": {"turns": 1.7, "pace": 0.6, "duration": 25.0},
    "eccentric_pulley": {"turns": 1.7, "pace": 0.6, "duration": 25.0},
    "lay_change": {"turns": 1.7, "pace": 0.6, "duration": 25.0},
    "late_encoder": {"measured": ("chirp", "sines"), "holdout": ("strokes",), "pace": 1.8},
    "filtered_encoder": {"measured": ("chirp", "sines"), "holdout": ("strokes",), "pace": 1.8},
    "late_load_cell": {"measured": ("chirp", "sines"), "holdout": ("strokes",)},
    "filtered_load_cell": {"measured": ("chirp", "sines"), "holdout": ("strokes",)},
    "carried_mass": {"measured": ("chirp", "sines"), "holdout": ("strokes",)},
}
"""Excitation that shows an effect."""

_LUGRE = (
    "eyring_film .05|carried_mass .08|late_stribeck .05|straight_presliding .06|maxwell_of_long_reach .10|"
    "kato_ageing .05|rough_in_pull .12|settling_bias .08|two_bodies_warm .12|running_in .10|wedge_of_lubricant .06|"
    "stiffening_return_spring .12|relaxing_sheath .08|filtered_load_cell .15|late_load_cell .15|short_converter .03|"
    "eyring_film .12|carried_mass .02|rough_in_pull .03"
)
_DRIVE = (
    "carried_mass .05|capstan .20|capstan .08|capstan .03|back_driving .10|kato_ageing .02|two_bodies_warm .08|"
    "running_in .06|eccentric_bearing .06|stiffening_return_spring .08|settling_bias .05|rough_in_pull .08|"
    "maxwell_of_long_reach .06|relaxing_sheath .05|worn_gaps .02|soft_toe .04|soft_toe .01|limp_side .02|"
    "kelvin_voigt .04|eccentric_pulley .02|lay_change .02|late_encoder .05|filtered_encoder .05|coarse_encoder .02|"
    "slipping_zero .03"
)
_SINGLE = (
    "capstan .20|capstan .08|carried_mass .06|logarithmic_weakening .08|kato_ageing .05|two_bodies_warm .10|"
    "running_in .08|relaxing_sheath .08|settling_bias .06"
)
_PAIRED = (
    "worn_gaps .03|kelvin_voigt .05|eccentric_pulley .03|lay_change .03|late_encoder .04|filtered_encoder .04|"
    "coarse_encoder .02|slipping_zero .02|worn_gaps .01"
)


def _listed(model: str, text: str) -> list[Case]:
    rows = (item.split() for item in text.split("|"))
    return [replace(_needing(Case("A", model), form), hidden=(form,), size=float(size)) for form, size in rows]


def _needing(case: Case, form: str) -> Case:
    return replace(case, **NEEDS.get(form, {}))  # pyright: ignore[reportArgumentType]


def _effects() -> list[Case]:
    cases = [
        *_listed("LuGreFriction", _LUGRE),
        *_listed("TendonDrive", _DRIVE),
        *_listed("SingleTsmDahl", _SINGLE),
        *_listed("PairedTsmBacklash", _PAIRED),
    ]
    return [replace(c, reference=k % 4 == 1) for k, c in enumerate(cases)]


def _wrong_parameters() -> list[Case]:
    wrong = {
        "TendonDrive": [("tau_c", "tau_s"), ("ratio",), ("c",), ("sigma2", "sigma0"), ("beta",)],
        "LuGreFriction": [("F_c", "F_s"), ("sigma2",), ("F_s",), ("sigma0", "F_c", "F_s")],
        "PairedTsmBacklash": [("c",), ("beta", "alpha")],
        "SingleTsmDahl": [("rho1",), ("rho2", "sigma")],
    }
    sizes = (0.03, 0.08, 0.15)
    found = [Case("B", model, wrong=names) for model, sets in wrong.items() for names in sets]
    found = [replace(c, size=sizes[k % 3]) for k, c in enumerate(found)]
    small = ("beta", "sigma2", "sigma0")
    return [replace(c, size=0.015 if c.wrong[0] in small else c.size, dip=c.wrong == ("F_s",)) for c in found]


def _instruments() -> list[Case]:
    poor = (
        Instruments(noise=0.015, colour=0.97),
        Instruments(noise=0.006, colour=0.9, jitter=0.08, stamped=False),
        Instruments(noise=0.004, colour=0.8, encoder=1e-3),
        Instruments(noise=0.02, colour=0.8, jitter=0.1),
    )
    rows = (
        "LuGreFriction carried_mass .08|TendonDrive capstan .12|PairedTsmBacklash worn_gaps .03|"
        "SingleTsmDahl capstan .15|"
        "LuGreFriction eyring_film .10|TendonDrive soft_toe .04|PairedTsmBacklash kelvin_voigt .05|"
        "LuGreFriction rough_in_pull .10|TendonDrive two_bodies_warm .10|TendonDrive lay_change .03|"
        "LuGreFriction |TendonDrive |PairedTsmBacklash |SingleTsmDahl "
    )
    found = []
    for k, row in enumerate(rows.split("|")):
        model, form, size = [*row.split(), "", "0"][:3]
        case = replace(Case("C", model), instruments=poor[k % 4], reference=k % 3 == 0)
        found.append(replace(_needing(case, form), hidden=(form,), size=float(size)) if form else case)
    return found


def _pairs() -> list[Case]:
    rows = (
        "LuGreFriction carried_mass eyring_film .10|LuGreFriction rough_in_pull carried_mass .08|"
        "LuGreFriction stiffening_return_spring two_bodies_warm .10|"
        "LuGreFriction maxwell_of_long_reach eyring_film .08|"
        "LuGreFriction running_in carried_mass .10|TendonDrive capstan soft_toe .04|"
        "TendonDrive carried_mass worn_gaps .03|"
        "TendonDrive two_bodies_warm kelvin_voigt .05|TendonDrive capstan stiffening_return_spring .08|"
        "TendonDrive limp_side rough_in_pull .03|TendonDrive eccentric_bearing lay_change .03|"
        "SingleTsmDahl capstan carried_mass .08|PairedTsmBacklash worn_gaps late_encoder .03|"
        "PairedTsmBacklash eccentric_pulley slipping_zero .02"
    )
    found = []
    for model, first, second, size in (row.split() for row in rows.split("|")):
        case = _needing(_needing(Case("D", model), first), second)
        found.append(replace(case, hidden=(first, second), size=float(size)))
    return found


def _outside() -> list[Case]:
    kinds = ("kinked_sheath", "tendon_rings", "neighbour_sticks", "gain_wanders", "other_joint_moves", "loose_contact")
    sizes = {"LuGreFriction": 0.10, "TendonDrive": 0.06, "PairedTsmBacklash": 0.02}
    found = [
        Case("E", model, hidden=(kind,), size=size, reference=k % 3 == 0)
        for k, kind in enumerate(kinds)
        for model, size in sizes.items()
        if not (kind == "kinked_sheath" and model == "PairedTsmBacklash")
    ]
    return found


def _nothing() -> list[Case]:
    kinds = (RICH, ("strokes", "chirp"), ("chirp", "sines"), ("work_rest", "sines"), ("sines",))
    models = ("LuGreFriction", "TendonDrive", "PairedTsmBacklash", "SingleTsmDahl")
    return [
        Case(
            "F", models[k % 4], measured=kinds[k % 5], reference=k % 4 == 3, dip=k in (4, 8),
            instruments=Instruments(noise=(0.004, 0.008, 0.015)[k % 3], colour=(0.0, 0.6, 0.95)[k % 3]),
        )
        for k in range(24)
    ]  # fmt: skip


def _not_excited() -> list[Case]:
    noisy = Instruments(noise=0.01, colour=0.4)
    slow: dict[str, object] = {"measured": ("slow", "slow"), "holdout": ("slow",), "pace": 0.35, "duration": 30.0}
    still: dict[str, object] = {"measured": ("sines", "steady"), "holdout": ("chirp",)}
    small: dict[str, object] = {"scale": 0.0015, "turns": 1.7, "pace": 0.6}
    rows: list[tuple[str, str, float, dict[str, object]]] = [
        ("LuGreFriction", "carried_mass", 0.05, slow), ("TendonDrive", "carried_mass", 0.04, slow),
        ("SingleTsmDahl", "carried_mass", 0.06, slow), ("LuGreFriction", "late_load_cell", 0.04, slow),
        ("LuGreFriction", "filtered_load_cell", 0.05, slow), ("PairedTsmBacklash", "late_encoder", 0.02, slow),
        ("PairedTsmBacklash", "filtered_encoder", 0.02, slow), ("TendonDrive", "late_encoder", 0.02, slow),
        ("TendonDrive", "capstan", 0.1, {"held": True}), ("SingleTsmDahl", "capstan", 0.1, {"held": True}),
        ("TendonDrive", "soft_toe", 0.03, {"held": True}), ("TendonDrive", "limp_side", 0.02, {"held": True}),
        ("LuGreFriction", "kato_ageing", 0.05, still), ("TendonDrive", "kato_ageing", 0.02, still),
        ("SingleTsmDahl", "kato_ageing", 0.05, still), ("LuGreFriction", "late_stribeck", 0.04, {**slow, "dip": True}),
        ("PairedTsmBacklash", "eccentric_pulley", 0.03, small), ("TendonDrive", "eccentric_pulley", 0.02, small),
    ]  # fmt: skip
    return [
        replace(Case("G", model, hidden=(form,), size=size, instruments=noisy), **settings)  # pyright: ignore[reportArgumentType]
        for model, form, size, settings in rows
    ]


def catalogue() -> list[Case]:
    """All cases in the order of their names, which is not that of the strata."""
    parts = (_effects, _wrong_parameters, _instruments, _pairs, _outside, _nothing, _not_excited)
    cases = [case for part in parts for case in part()]
    order = np.random.default_rng(20).permutation(len(cases))
    named = [replace(c, name=f"case_{order[k]:03d}", seed=4000 + 7 * k) for k, c in enumerate(cases)]
    return sorted(named, key=lambda c: c.name)


def selected(cases: int | None = None, strata: str = STRATA) -> list[Case]:
    """A part of the catalogue: at most so many cases, spread evenly over the strata.

    Parameters
    ----------
    cases : int, optional
        All without it. The same number selects the same cases each time.
    strata : str
        Letters of the strata wanted.
    """
    wanted = [c for c in catalogue() if c.stratum in strata]
    if cases is None or cases >= len(wanted):
        return wanted
    by_stratum = [[c for c in wanted if c.stratum == letter] for letter in strata]
    turns = [c for row in range(len(wanted)) for group in by_stratum for c in group[row : row + 1]]
    return sorted(turns[:cases], key=lambda c: c.name)


GATE = (
    "A PairedTsmBacklash kelvin_voigt", "A SingleTsmDahl capstan", "B LuGreFriction", "C TendonDrive capstan",
    "D LuGreFriction carried_mass eyring_film", "E LuGreFriction kinked_sheath",
    "F LuGreFriction", "F TendonDrive", "F PairedTsmBacklash", "G TendonDrive soft_toe",
)  # fmt: skip
"""Cases that the system tests run: the first of each kind in the order of the catalogue, no effect twice in a model."""


def gate() -> list[Case]:
    """The cases of `GATE`."""
    cases = sorted(catalogue(), key=lambda c: c.seed)
    return [next(c for c in cases if " ".join((c.stratum, c.model, *c.hidden)) == text) for text in GATE]
