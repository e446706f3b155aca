"""What the variables of a model are for those that work with any model: chains, fits, diagnosis, FMUs.

Models import these from contract.py. Roles travel into FMUs: this file imports ``typing`` alone.
"""

from typing import Any, Callable, Mapping, NamedTuple  # noqa: UP035  a kernel file imports nothing but typing and math


class FrictionPort(NamedTuple):
    """Where the friction is in a model's outputs, for the effects that change it.

    Attributes
    ----------
    like : str
        An input or output that has the friction's unit.
    read : callable
        ``read(p, u, o) -> f``: the friction in the outputs.
    write : callable
        ``write(p, u, o, f) -> Outputs``: the outputs with the friction ``f`` instead.
    scale : str
        Parameter by which the levels among the parameters are multiplied; '' where they are those of the friction.
    """

    like: str
    read: Callable[[Any, Any, Any], Any]
    write: Callable[[Any, Any, Any, Any], Any]
    scale: str = ""


SLIDING_SHARE = 0.9
"""Part of its deflection of sliding at which a presliding state is taken to slide, for a load that is held."""


class HeldLoad(NamedTuple):
    """How a model that estimates its load keeps it while the drive sticks, for effects that widen the friction band.

    Attributes
    ----------
    level : callable
        ``level(p, v) -> f``: friction of sliding at the speed ``|v|``.
    between : callable
        ``between(last, pull, release) -> load``: the load kept between those of sliding in either direction.
    write : callable
        ``write(p, u, o, load) -> Outputs``: the outputs with that load.
    """

    level: Callable[[Any, float], float]
    between: Callable[[float, float, float], float]
    write: Callable[[Any, Any, Any, float], Any]


class DefaultExperiment(NamedTuple):
    """A simulation that shows what a model does: the default experiment of its FMU.

    Attributes
    ----------
    stop : float
        End of the simulation, from 0 [s].
    step : float
        Communication step [s].
    """

    stop: float = 20.0
    step: float = 1e-3


class Roles(NamedTuple):
    """What the variables of a model are for those that work with any model: chains, fits, diagnosis, FMUs.

    Names are public ones. A model without a role leaves it out.

    Attributes
    ----------
    motion : str
        The input that is the position of the drive; a model without one may have an input ``v``, its speed.
    load : str
        The input or output that loads the distal side.
    drive : str
        The input or output that is the load or tension at the drive side.
    offsets, initial : tuple of str
        Parameters that each run has of its own: offsets of sensors, and states at the start.
    has : mapping of str to tuple of str
        Effects that are in the model's own law, by id, with the parameters that make each.
    depends : mapping of str to tuple of str
        Inputs that an output follows at once; an output that is not in it follows all of them.
    friction : FrictionPort or None
        Present: the model can carry friction effects.
    lost_motion : mapping of str to callable
        ``lost_motion[x](p, u, o) -> float``: how far the output ``x`` lags behind the drive, by output; there the
        model can carry effects that change what friction does to a motion.
    held_load : HeldLoad or None
        Present: the model has a parameter ``hold`` and states ``slid``, ``v_in`` and that of its `load`.
    plausible : tuple of Condition
        What parameters of any rig meet together; a simulation does without, a diagnosis keeps its fits there.
    any_unit : bool
        Whether inputs and outputs take any unit, as a sum does: FMUs and systems then declare none for them, so that no
        host looks for a conversion.
    experiment : DefaultExperiment
        Stop time and step that suit the model.
    """

    motion: str = ""
    load: str = ""
    drive: str = ""
    offsets: tuple[str, ...] = ()
    initial: tuple[str, ...] = ()
    has: Mapping[str, tuple[str, ...]] = {}
    depends: Mapping[str, tuple[str, ...]] = {}
    friction: FrictionPort | None = None
    lost_motion: Mapping[str, Callable[[Any, Any, Any], Any]] = {}
    held_load: HeldLoad | None = None
    plausible: tuple[Any, ...] = ()
    any_unit: bool = False
    experiment: DefaultExperiment = DefaultExperiment()
