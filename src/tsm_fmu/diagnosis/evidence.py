"""The parts of a diagnosis, as plain immutable data: gaps, candidates, places, formulas, fits, runs, the next motion.

Quantities are in SI; ``unit`` says which. Arrays are not to be changed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ..effects import id_of
from ..effects.about import Family
from ..kernels.arrays import BoolArray, FloatArray
from ..logs.record import Record


@dataclass(frozen=True)
class Gate:
    """What the check of the data says of the measured runs.

    Attributes
    ----------
    notes : tuple of str
        Findings of the data check, one sentence each with the run's name. What a run alone does not cover is a finding
        where it is the only one; what several do not show together is said by `visibility`.
    refused : tuple of str
        Why no answer can come from these runs; empty if one can.
    """

    notes: tuple[str, ...] = ()
    refused: tuple[str, ...] = ()


@dataclass(frozen=True)
class Gap:
    """How far one channel is from its measurement: root mean squares (RMS) of measured minus simulated, in ``unit``.

    Attributes
    ----------
    unit : str
    before, refitted, after : float
        On the measured runs: the model as given, with refitted parameters, and with the effects of the answer.
    holdout_before, holdout_refitted, holdout_after : float or None
        The same on held-out runs; None without any.
    floor : float
        RMS below which nothing can be explained, as far as these runs tell.
    floor_least : float
        The part of ``floor`` that is noise, or left on reference runs, whatever the missing law is.
    closure, closure_least : float or None
        Share of the mean square above ``floor`` (above ``floor_least``) that is gone, on held-out runs if there are
        any: from the refitted model on where effects are added, else from the model as given. None without a gap.
    closure_interval : tuple of (float, float) or None
        90 % bootstrap interval of ``closure`` over runs; None with fewer than three.
    fmu : float or None
        ``after`` as the exported FMU has it; known once one is written.
    threshold : float
        RMS that an effect must remove to be named.
    reference : float or None
        Left on reference runs by the refitted model; None without any.
    unexplained : bool
        Whether something lawful is left that no effect explains.
    elsewhere : bool
        Whether only held-out runs show that.
    """

    unit: str
    before: float
    after: float
    holdout_before: float | None
    holdout_after: float | None
    floor: float
    floor_least: float
    closure: float | None
    closure_least: float | None
    closure_interval: tuple[float, float] | None
    refitted: float
    holdout_refitted: float | None
    fmu: float | None = None
    threshold: float = 0.0
    reference: float | None = None
    unexplained: bool = False
    elsewhere: bool = False


@dataclass(frozen=True)
class ChannelError:
    """What a fit leaves of one channel.

    Attributes
    ----------
    measured : float
        RMS on the measured runs.
    closure_measured, closure_holdout : tuple of (float, float) or None
        Share of the refitted model's gap that is gone, counted above the least and above the full floor; None where
        there is no gap, or no held-out run.
    holdout : float or None
        RMS on held-out runs if there are any: the refitted model's, less what the effect takes away on their samples
        that fits are judged by.
    """

    measured: float
    closure_measured: tuple[float, float] | None = None
    closure_holdout: tuple[float, float] | None = None
    holdout: float | None = None


@dataclass(frozen=True)
class AnswerStep:
    """Some effects of an answer of several, refitted with the model: on the way to the answer.

    Attributes
    ----------
    effects : tuple of str
        As ``id`` or ``id@channel``, in the order added.
    measured, holdout : mapping of str to float
        RMS by channel; ``holdout`` is empty without held-out runs.
    """

    effects: tuple[str, ...]
    measured: Mapping[str, float]
    holdout: Mapping[str, float]


@dataclass(frozen=True)
class Candidate:
    """An effect after its refit together with the model; those of the answer after their common refit.

    Attributes
    ----------
    spec : str
        Effect and place, ``id`` or ``id@channel``.
    score : float
        What it removes beyond the refitted model with its nuisance parameters [dB of the mean square, all channels
        together, the mean of measured and held-out runs].
    closure_measured, closure_holdout : float or None
        Share of the removable mean square, over all channels, that is gone; from the refitted model on.
    parameters : mapping of str to float
        Values of its own parameters.
    units : mapping of str to str
        Their units.
    channels : mapping of str to ChannelError
    misfit : float
        Mean square error over the variance of the channel, summed over the channels.
    testable : bool
        Whether these runs could have shown the effect.
    """

    spec: str
    score: float
    closure_measured: float | None
    closure_holdout: float | None
    parameters: Mapping[str, float]
    units: Mapping[str, str] = field(default_factory=dict)
    channels: Mapping[str, ChannelError] = field(default_factory=dict)
    misfit: float = 0.0
    testable: bool = True

    @property
    def effect(self) -> str:
        """Id of the effect."""
        return id_of(self.spec)


@dataclass(frozen=True)
class Place:
    """Where a channel's residual concentrates along one coordinate.

    Attributes
    ----------
    channel, coordinate, unit : str
        ``coordinate`` is one of x, v, a, sgn v, distance since reversal, dwell, time, load, drum angle, or in Hz:
        ``odd harmonics``, ``even harmonics`` and ``harmonic k`` of a periodic motion, ``frequency`` of any other.
    range : tuple of (float, float)
        Part of the coordinate in which most of the residual lies; of harmonics the lowest and highest counted.
    share_of_gap : float
        Share of the residual's mean square in that range.
    share_of_samples : float
        What chance alone would give: the share of the samples, of a frequency that of the residual's background.
    explained : float
        Share of the residual's variance that is a function of the coordinate, one for each direction of motion.
    chance : float
        The same in noise of the residual's colour.
    p : float
        Probability of such a function, beyond what the direction alone gives, in that noise.
    significant : bool
        After Benjamini-Hochberg over all coordinates and channels.
    rms : float
        RMS of the part of the residual that is a function of the coordinate, beyond chance, in the channel's unit.
    """

    channel: str
    coordinate: str
    unit: str
    range: tuple[float, float]
    share_of_gap: float
    share_of_samples: float
    explained: float
    chance: float
    p: float
    significant: bool
    rms: float = 0.0


@dataclass(frozen=True)
class Tone:
    """A tone that a model leaves of a channel.

    Attributes
    ----------
    frequency : float
        [Hz]
    rms, beside : float
        Of the tone, and of what is left beside it, in the channel's SI unit.
    taken_out : bool
        Whether the runs are compared less this tone.
    """

    frequency: float
    rms: float
    beside: float
    taken_out: bool = False


@dataclass(frozen=True)
class Wander:
    """A zero that wanders within a run, slower than the motion.

    Attributes
    ----------
    rms : float
        Of the wandering about the zero of each run, in the channel's SI unit.
    period : float
        Of the fastest slow function that is taken for it [s].
    """

    rms: float
    period: float


@dataclass(frozen=True)
class Limit:
    """A limit that a channel stands at where the model goes on.

    Attributes
    ----------
    level : float
        In the channel's SI unit.
    share : float
        Part of the samples that are there.
    excess : float
        RMS of what the model is off there, over that elsewhere: as given or refitted, whichever is more.
    """

    level: float
    share: float
    excess: float


@dataclass(frozen=True)
class FamilyShare:
    """What the laws of a family predict of the residual of one channel.

    Attributes
    ----------
    family, channel : str
    share : float
        Share of the mean square that a law has of which the model's parameters do not already do what it does.
    how : str
        "predicted" on parts that were left out; or what the "steps" of a converter make, or what is "slow" and moves
        with nothing that the log holds.
    """

    family: Family
    channel: str
    share: float
    how: Literal["predicted", "steps", "slow"] = "predicted"


@dataclass(frozen=True)
class Dependence:
    """Mean of a residual over one coordinate, in one direction of motion.

    Attributes
    ----------
    coordinate, unit : str
    direction : str
        ``forth``, ``back`` or, for both, empty.
    at : ndarray, shape (bins,)
        Mean of the coordinate in each bin.
    mean, low, high : ndarray, shape (bins,)
        Of the residual, with a 90 % interval from a bootstrap over blocks of several autocorrelation times.
    """

    coordinate: str
    unit: str
    direction: str
    at: FloatArray
    mean: FloatArray
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True)
class Formula:
    """A short sum of functions that predicts a residual.

    Attributes
    ----------
    terms : tuple of (str, float, str)
        Function, coefficient and its SI unit.
    text : str
        As people read it; empty if nothing predicts the residual.
    share : float
        Share of the residual's mean square that a formula of this size predicts on parts that did not choose it.
    p : float
        Probability of as much in noise of the residual's colour.
    optimiser : str
    """

    terms: tuple[tuple[str, float, str], ...] = ()
    text: str = ""
    share: float = 0.0
    p: float = 1.0
    optimiser: str = "orthogonal least squares"


@dataclass(frozen=True)
class ResidualShape:
    """What the residual of one channel looks like over the coordinates of the motion."""

    channel: str
    unit: str
    dependences: tuple[Dependence, ...] = ()
    formula: Formula = Formula()


@dataclass(frozen=True)
class ParameterValue:
    """One parameter of a `ModelFit`; the mean over the runs where each has its own."""

    name: str
    value: float
    unit: str
    meaning: str


@dataclass(frozen=True)
class ParameterChange:
    """A parameter that the answer's fit moved.

    Attributes
    ----------
    name, unit : str
    before, after : float
    effect : float
        RMS over the spread of the channel that it moves most, if it alone had its old value; infinite where the model
        cannot run so.
    """

    name: str
    unit: str
    before: float
    after: float
    effect: float


@dataclass(frozen=True)
class ModelFit:
    """The model at one stage of the diagnosis.

    Attributes
    ----------
    model : str
        Base model.
    effects : tuple of str
        Attached, as ``id`` or ``id@channel``.
    parameters : tuple of ParameterValue
    """

    model: str
    effects: tuple[str, ...]
    parameters: tuple[ParameterValue, ...]

    @property
    def values(self) -> dict[str, float]:
        """Values by name."""
        return {p.name: p.value for p in self.parameters}


@dataclass(frozen=True)
class RunComparison:
    """A measured run beside its simulations, from where it is compared.

    Attributes
    ----------
    record : Record
        As it was read, its motion between the steps of an encoder.
    time : ndarray, shape (n,)
        The samples of the record that are compared: the last n.
    measured : ndarray, shape (n, channels)
    simulated : mapping of str to ndarray, shape (n, channels)
        By stage: ``given``, ``refitted``, ``final``.
    motion : ndarray, shape (n,), or None
        The position or speed that drives the model.
    per_run : mapping of str to float
        Parameters, by public name, of which this run has values of its own in the final model.
    unresolved : ndarray of bool, shape (n, channels)
        Values of which the log leaves something open; empty where there are none.
    """

    record: Record
    time: FloatArray
    measured: FloatArray
    simulated: Mapping[str, FloatArray]
    motion: FloatArray | None
    per_run: Mapping[str, float]
    unresolved: BoolArray = field(default_factory=lambda: np.empty((0, 0), bool))

    def error(self, simulated: FloatArray) -> FloatArray:
        """Measured minus simulated, shape (n, channels), nought where the log leaves something open."""
        difference = self.measured - simulated
        return np.where(self.unresolved, 0.0, difference) if self.unresolved.size else difference


@dataclass(frozen=True)
class NextMotion:
    """A motion to play, within the range and speed that the rig has shown, that tells rivals apart.

    Attributes
    ----------
    name : str
        What to do, in words.
    time : ndarray, shape (n,)
    columns : mapping of str to ndarray, shape (n,)
        Inputs of the model by name.
    units : mapping of str to str
    separation : float
        RMS over the floor of what the least separated pair of rivals predicts differently.
    """

    name: str
    time: FloatArray
    columns: Mapping[str, FloatArray]
    units: Mapping[str, str]
    separation: float
