"""Effects in words: what people call them, and what a log must contain to show them (effects.md, end of section 2)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Excitation:
    """Name of an effect in a sentence, and the motion that shows it."""

    words: str
    shown_by: str


EXCITATION = {
    "coulomb": Excitation("Coulomb friction", "strokes with reversals at a speed well above standstill"),
    "viscous": Excitation("speed-dependent friction", "the same stroke at three speeds or more, a factor of ten apart"),
    "stribeck": Excitation("Stribeck friction", "slow strokes, from creeping up to a tenth of the usual speed"),
    "acceleration_branches": Excitation(
        "branches of friction for acceleration and deceleration",
        "the same speeds reached speeding up and slowing down: sines of two frequencies over one stroke",
    ),
    "inertia": Excitation("inertia", "one stroke at two frequencies or more, the fastest with high acceleration"),
    "friction_lag": Excitation("a lag of the friction behind the speed", "fast changes of speed without a reversal"),
    "presliding_shape": Excitation(
        "another curve of friction after reversals", "finely sampled reversals, also of strokes within the presliding"
    ),
    "nonlocal_memory": Excitation("hysteresis with non-local memory", "nested reversals: small strokes in large ones"),
    "breakaway_ageing": Excitation("break-away that grows with rest", "slide, hold 0.1 s to 30 s, slide again"),
    "load_dependence": Excitation("load-dependent friction", "the same motion under three loads or more, recorded"),
    "bend_angle": Excitation("bend-dependent friction", "the same motion at several sheath angles, Theta recorded"),
    "drive_direction": Excitation(
        "friction that depends on which side drives", "a load that drives one way and brakes the other"
    ),
    "direction_asymmetry": Excitation(
        "friction that differs between directions", "half strokes both ways at several speeds, zero known"
    ),
    "offset_drift": Excitation("an offset or drift", "a long run with a return to the same place, or rests in between"),
    "gain_error": Excitation("a gain error", "strokes of several sizes; a known reference for scale"),
    "backlash": Excitation("backlash", "slow strokes wider than the gap, and some within it"),
    "smooth_backlash": Excitation("rounded backlash", "slow strokes wider than the gap, reversals finely sampled"),
    "tendon_elasticity": Excitation("tendon elasticity", "the same motion under several tensions or loads"),
    "stiffness_hardening": Excitation("stiffening", "strokes or loads up to the largest that the rig allows"),
    "slack": Excitation("slack", "low pretension, with the load taken off within the run"),
    "creep": Excitation("creep", "steps of load or position, held for several times the time constant"),
    "thermal": Excitation("friction that changes with warmth", "minutes of motion, a rest, and the same motion again"),
    "wear": Excitation("friction that changes with travel", "long travel, a rest, and the same motion again"),
    "drum_periodic": Excitation("a ripple of the drum angle", "several turns of the drum, started at different angles"),
    "winding_crossover": Excitation("crossover of the winding", "several turns of the drum, up to the next layer"),
    "delay": Excitation("a delay", "a frequency sweep, or fast motion with sharp corners"),
    "sensor_lag": Excitation("a lag of the sensor", "a frequency sweep up to the sensor's bandwidth"),
    "quantisation": Excitation("quantisation", "slow motion over a few steps of the sensor"),
}


def words(spec: str) -> str:
    """Name of an effect in a sentence; ``id@channel`` says the channel."""
    name, _, channel = spec.partition("@")
    said = EXCITATION[name].words if name in EXCITATION else name.replace("_", " ")
    return f"{said} in {channel}" if channel else said
