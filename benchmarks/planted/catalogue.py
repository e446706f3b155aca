"""Which effect is planted where, how large, and in what motion."""

from __future__ import annotations

from dataclasses import dataclass, replace

FORCE = ("LuGreFriction", "SingleTsmDahl", "SingleTsmBoucWen", "SingleTsmLuGre", "PairedTsmFriction")
DRIVES = ("TendonDrive", "DistalEstimator")
LOADED = (*FORCE[1:], *DRIVES)
MOTIONS = ("PairedTsmBacklash", *DRIVES)
CHANNELS = {**dict.fromkeys(FORCE, ("F",)), "PairedTsmBacklash": ("x_out",), "TendonDrive": ("x_out", "tau_in"),
            "DistalEstimator": ("x_out", "tau_out")}  # fmt: skip
"""Measured channels of each model."""
KNOWN = {
    "LuGreFriction": ("F_c", "F_s", "v_s", "sigma0"),
    "SingleTsmDahl": ("rho1", "rho2", "sigma"),
    "SingleTsmBoucWen": ("rho1", "rho2", "k", "sigma", "n"),
    "SingleTsmLuGre": ("rho1", "rho2", "rho", "lambda"),
    "PairedTsmFriction": ("rho", "sigma", "n", "k_zeta", "lambda"),
    "PairedTsmBacklash": ("c", "beta", "alpha"),
    "TendonDrive": ("c", "beta", "alpha", "ratio", "sigma0", "tau_c", "tau_s", "v_s"),
    "DistalEstimator": ("c", "beta", "alpha", "ratio", "sigma0", "tau_c", "tau_s", "v_s"),
}
"""Parameters that are known, where the effect is one that they could stand for."""


@dataclass(frozen=True)
class Case:
    """An effect in a rig.

    Attributes
    ----------
    effect, model : str
    channel : str
        Where it acts; '' for the friction.
    share : float
        RMS of what it changes, over the RMS of what it acts on.
    motions : tuple of str
        One run each; the last one is held out.
    rows : int
        Samples of a run.
    scale, pace, dip, loaded
        As in `rigs.signals`.
    known : bool
        The parameters of `KNOWN` are right, and fixed.
    also : tuple of str
        Effects whose law holds the planted one too, so that no log tells them apart: a set with them is right.
    """

    effect: str
    model: str
    channel: str = ""
    share: float = 0.15
    motions: tuple[str, ...] = ("strokes", "sines")
    rows: int = 1500
    scale: float = 1.0
    pace: float = 1.0
    dip: bool = False
    loaded: float = 1.0
    known: bool = False
    also: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Effect, model and place."""
        return f"{self.effect} in {self.model}{'@' if self.channel else ''}{self.channel}"


def _friction(case: Case, models: tuple[str, ...]) -> list[Case]:
    return [replace(case, model=model) for model in models]


def _channels(case: Case, models: tuple[str, ...], motion_only: bool = False) -> list[Case]:
    return [
        replace(case, model=model, channel=channel)
        for model in models for channel in CHANNELS[model] if channel == "x_out" or not motion_only
    ]  # fmt: skip


def catalogue() -> list[Case]:
    """All cases, those of one effect behind each other; the first one of each is that of the test suite."""
    long = Case("", "", scale=9.3, pace=0.4, rows=2500)
    work = Case("", "", motions=("work_rest", "work_rest"), rows=2500)
    every = (*FORCE, *DRIVES)
    unloaded = Case("", "", loaded=0.1)  # beside a load, what follows a reversal is a small part of a torque
    # at one pace a lag of the channel does the same; without any load an estimator of it has nothing to measure
    paced = replace(unloaded, motions=("paced", "paced"), rows=2500, loaded=0.3)
    drifting = ("strokes", "nested", "sines")  # one run alone may as well creep back from where it began
    return [
        *_friction(Case("coulomb", "", known=True), DRIVES),  # elsewhere it is an error of the channel's gain
        *_friction(Case("viscous", ""), FORCE[1:4]),  # the others have it
        *_friction(Case("stribeck", ""), FORCE[1:]),
        *_friction(Case("acceleration_branches", "", motions=("sines", "strokes")), every),
        *_friction(Case("inertia", "", motions=("sweep", "sines")), every),
        Case("friction_lag", "LuGreFriction", share=0.08, motions=("sines", "sines"), dip=True, pace=1.6),
        *_friction(replace(paced, effect="presliding_shape", share=0.4, known=True), every),
        *_friction(replace(unloaded, effect="nonlocal_memory", share=0.6, motions=("nested", "sines")), every),
        *_friction(Case("breakaway_ageing", "", share=0.12, motions=("strokes", "strokes"), rows=2000), every),
        *_friction(Case("load_dependence", "", share=0.3, also=("drive_direction",)), LOADED),  # k_m = 0 is this law
        *_friction(Case("bend_angle", "", share=0.4), LOADED),
        *_friction(Case("temperature_dependence", "", share=0.08), every),
        *_friction(
            Case("drive_direction", "", share=0.3, motions=("sines", "strokes")), DRIVES
        ),  # strokes hardly brake
        *_friction(Case("direction_asymmetry", "", share=0.3), ("LuGreFriction", *DRIVES)),
        *_channels(Case("offset_drift", "", share=0.2, motions=drifting), FORCE),
        *_channels(
            Case("offset_drift", "", share=0.2, motions=drifting, known=True), MOTIONS
        ),  # a wide slow loop drifts
        *_channels(Case("gain_error", "", share=0.08, known=True), MOTIONS),
        *_channels(Case("backlash", "", share=0.08), MOTIONS, motion_only=True),
        *_channels(Case("smooth_backlash", "", share=0.12, known=True), MOTIONS, motion_only=True),
        *_channels(Case("tendon_elasticity", "", share=0.08), DRIVES, motion_only=True),
        *_friction(Case("stiffness_hardening", "", share=0.25), every),
        *_channels(Case("slack", "", share=0.08), DRIVES, motion_only=True),
        *_channels(Case("creep", "", share=0.08), MOTIONS, motion_only=True),
        *_friction(Case("creep", "", share=0.2), every),
        *_friction(replace(work, effect="thermal"), every),
        *_friction(replace(work, effect="wear", share=0.25), every),
        *_channels(replace(long, effect="drum_periodic", share=0.03), MOTIONS, motion_only=True),
        *_friction(replace(long, effect="drum_periodic", share=0.2), DRIVES),
        *_channels(replace(long, effect="winding_crossover", share=0.02), MOTIONS, motion_only=True),
        *_channels(Case("delay", "", share=0.15, motions=("sweep", "sines")), (*MOTIONS, *FORCE)),
        *_channels(Case("sensor_lag", "", share=0.15, motions=("sweep", "sines")), (*MOTIONS, *FORCE)),
        *_channels(Case("quantisation", "", share=0.06), (*MOTIONS, *FORCE)),
    ]


def first_of_each() -> list[Case]:
    """One case an effect."""
    found: dict[str, Case] = {}
    for case in catalogue():
        found.setdefault(case.effect, case)
    return list(found.values())
