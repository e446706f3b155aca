"""How an effect says what is known of it: its file holds one `Effect`, and a `Size` or `Shape` at each parameter.

Effects travel into FMUs, and this file with them: it imports ``typing`` alone.
"""

from typing import Literal, NamedTuple

Place = Literal["friction", "lost motion", "output", "input"]
"""What an effect changes: the friction of a model, what friction takes of a distal motion, one of its outputs, one of
its inputs."""

Role = Literal["effect", "nuisance", "read"]
"""``effect``: it is missing, or it is not. ``nuisance``: every rig has a little of it, so each refit of a diagnosis may
use it; it is missing where it does more than that. ``read``: plain in the log, nothing is fitted."""

Family = Literal["position", "speed", "acceleration", "load", "time", "history", "direction", "sensor"]
"""What the law of an effect is over. ``load``: loads, tensions, sheath angles. ``time``: also travel and warmth.
``history``: what the motion was before, as after a reversal or a rest. ``direction``: the sign of the motion alone.
``sensor``: the measured signal itself, and its clock."""

Scale = Literal[
    "stroke",
    "per stroke",
    "position",
    "centre",
    "travel",
    "speed",
    "acceleration",
    "time",
    "load",
    "turns",
    "angle",
    "width",
    "share",
    "exponent",
    "number",
]
"""What the range of a shape parameter is counted in, of the runs in which the effect is looked for.

``stroke``: width of the motion; ``per stroke``: its inverse. ``position``: 0 is the lowest and 1 the highest position
of the motion, so a position may be negative; ``centre``: the same, of a law that is another one unless that is near the
middle. ``travel``: path of the longest run. ``speed``, ``acceleration``: their RMS. ``time``: length of the longest
run. ``load``: its largest magnitude. ``turns``: of a drum within the motion; the parameter is the motion per radian of
the drum, so that a wheel of any size is found. ``angle``: rad. ``width``: rad, beyond whose range the law is another
one. ``share``: a part of the whole. ``exponent``: 1, of a law that is another one beyond. ``number``: 1, or one per
radian. Positions, centres, angles, widths, turns and shares are spread evenly over their range, the others over its
logarithm.
"""

AsNuisance = Literal["free", "per run", "zero"]
"""What a size does in a refit that may use its effect as a nuisance: it is fitted, it is fitted for each run, or it
stays zero until the effect itself is looked for."""


class Size(NamedTuple):
    """A parameter that alone takes the effect out of neutral: how much of it there is.

    Attributes
    ----------
    first : float
        First value tried, in the parameter's unit; the search goes on from its response.
    as_nuisance : str
        See `AsNuisance`.
    most_steps : int
        Steps of a log that a time may be at most; 0 for any.
    most_of_signal : float
        Times the RMS of what the effect changes that a diagnosis takes at most; 0 for any.
    tries : tuple of float
        Parts of the stroke that a search begins from where the effect is on the motion of a model: what it does there
        does not grow with it.
    """

    first: float = 1e-2
    as_nuisance: AsNuisance = "free"
    most_steps: int = 0
    most_of_signal: float = 0.0
    tries: tuple[float, ...] = ()


class Shape(NamedTuple):
    """A parameter that does nothing without a size: where, how fast, over what travel, with which exponent.

    Attributes
    ----------
    scale : str
        See `Scale`.
    lo, hi : float
        Range over that scale in which the effect has its signature; beyond it looks like another one.
    tries : int
        Values that a search begins from, where more are needed than usual.
    """

    scale: Scale
    lo: float
    hi: float
    tries: int = 0


class Read(NamedTuple):
    """A parameter that is read from the log with the effect."""


class Start(NamedTuple):
    """A state at the start of a run that its log does not say: each run has a value of its own.

    Attributes
    ----------
    scale : str
        See `Scale`.
    tries : tuple of float
        Values over that scale that a search begins from, in any run.
    """

    scale: Scale
    tries: tuple[float, ...]


class Effect(NamedTuple):
    """What is known of an effect besides its equation.

    Attributes
    ----------
    words : str
        Its name in a sentence.
    signature : str
        What it looks like, in one phrase.
    shown_by : str
        Motion that a log must hold to show it.
    places : tuple of str
        See `Place`.
    family : str
        See `Family`.
    looks_like : tuple of str
        Ids of effects that it hides behind, or they behind it, where a log is poor.
    role : str
        See `Role`.
    after_reversal : bool
        It is a law of what friction does after a reversal, of which no rig has quite that of its model: a little of it
        corrects the form of the model and is not missing.
    play : bool
        It is play: a thing of its own alone, and as much a law of what follows a reversal beside another effect.
    motion_only : bool
        It makes sense on a position only; where the motion of a model is a speed it acts on the way that belongs to it.
    searched : tuple of str
        Places where a diagnosis looks for it, if not at the friction and the outputs among `places`.
    optional : tuple of str
        Signals that it may be without: it takes them as 1 where neither the model nor a column has them.
    at_outputs : tuple of str
        Signals that it takes at an output only, as 0 where neither the model nor a column has them.
    turns : float
        Turns of a drum whose angle the motion is that it must make for runs without the effect to say so.
    core : tuple of str
        Sizes that make most of it, or what is left is another law.
    among_functions : bool
        Residuals are compared with it at many shapes: it is among the functions that tell its family.
    fitted_as : str
        Word for it where an identification fits it beside the model (``--nuisance WORD@CHANNEL``); '' if it cannot.
    words_on_motion : str
        Its name in a sentence where it changes the lost motion of a distal position; '' if it cannot.
    """

    words: str
    signature: str
    shown_by: str
    places: tuple[Place, ...]
    family: Family
    looks_like: tuple[str, ...] = ()
    role: Role = "effect"
    after_reversal: bool = False
    play: bool = False
    motion_only: bool = False
    searched: tuple[Place, ...] | None = None
    optional: tuple[str, ...] = ()
    at_outputs: tuple[str, ...] = ()
    turns: float = 0.0
    core: tuple[str, ...] = ()
    among_functions: bool = False
    fitted_as: str = ""
    words_on_motion: str = ""

    @property
    def looked_for(self) -> tuple[Place, ...]:
        """Places where a diagnosis looks for it."""
        return tuple(p for p in self.places if p != "input") if self.searched is None else self.searched
