"""MSSP 2015: its models as FMUs on the motions that Section 7 imposes, without motor and controller."""

from __future__ import annotations

from collections.abc import Mapping

from ...cosim.ssp import Case
from ...cosim.system import Component, Connection, Experiment, System, Value
from ...cosim.trajectory import Trajectory
from ...kernels.kernel import kernel
from ...scenarios import mssp_feedforward
from ..loops import FMUS, co_simulate
from .printed import MOTIONS

EXPERIMENT = Experiment(stop=20.0, step=2e-3, evaluate_from=10.0, tracking_error="error.y")
TURN = 1.2
"""Where the ramp turns back [rad]."""


def runs() -> dict[str, Trajectory]:
    """Both motions with law 1 and law 2 and the published set throughout, and a ramp that turns back."""
    published = mssp_feedforward.plant()
    found: dict[str, Case] = {}
    for motion in MOTIONS:
        reference = kernel("ReferenceSignal").presets[mssp_feedforward.MOTIONS[motion][0]].si
        found[motion] = (_system(motion, reference, published), EXPERIMENT)
    ramp: dict[str, Value] = {"kind": 2, "speed": 1.0, "stroke": TURN, "cycles": 1.0}
    experiment = Experiment(stop=2.0 * TURN, step=1e-3, evaluate_from=TURN)
    found["ramp"] = (_system("ramp", ramp, published), experiment)
    return co_simulate(found)


def _system(name: str, reference: Mapping[str, Value], backlash: Mapping[str, Value]) -> System:
    raw = kernel("PairedTsmFriction").presets["raw"].si
    parts = [
        Component("reference", FMUS["ReferenceSignal"], reference),
        Component("backlash", FMUS["PairedTsmBacklash"], backlash),
        Component("friction", FMUS["PairedTsmFriction"], {**raw, "tau_in": 0.0, "tau_load": 0.0}),
    ]
    wires = [
        ("reference.y", "backlash.x_in"),
        ("reference.y", "friction.x"),
        ("reference.dy", "friction.v"),
        ("reference.ddy", "friction.a"),
    ]
    for law in (1, 2):
        parts += [
            Component(f"law_{law}", FMUS["FeedforwardCompensator"], {**backlash, "law": law}),
            Component(f"plant_{law}", FMUS["PairedTsmBacklash"], backlash),
            Component(f"error_{law}", FMUS["Sum"], {"k2": -1.0, "u3": 0.0}),
        ]
        wires += [
            ("reference.y", f"law_{law}.x_r"),
            (f"law_{law}.x_ff", f"plant_{law}.x_in"),
            ("reference.y", f"error_{law}.u1"),
            (f"plant_{law}.x_out", f"error_{law}.u2"),
        ]
    return System(tuple(parts), tuple(Connection(*wire) for wire in wires), name)
