"""``simulate``: a measured run replayed through an FMU, a model card or a model."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..cosim.isolation import simulation
from ..cosim.replay import agreement, check_measured
from ..cosim.system import Value
from ..cosim.trajectory import Trajectory, write_trajectory
from ..logs.agreement import Agreement
from ..logs.display import display
from ..logs.record import Record, cutoff_note, kernel_inputs
from ..models.contract import InputError
from ..report.text import preformatted, text_table
from . import TIME_LIMIT
from .models import ModelLike, resolve_model
from .runs import RunLike, records_of

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import NDArray

    from ..report.figures import Figure


@dataclass(frozen=True)
class SimulateResult:
    """A run replayed; see `simulate`. ``result["x_out"]`` is one output.

    Attributes
    ----------
    trajectory : Trajectory
        Time and outputs by name, one row for each row of the run, fewer if the FMU ended it; its
        messages say what was derived.
    agreement : mapping of str to Agreement
        Errors of the outputs that the run holds, in SI.
    record : Record
    wall_s : float
        Time that the simulation took [s].
    """

    trajectory: Trajectory
    agreement: Mapping[str, Agreement]
    record: Record
    wall_s: float

    def __getitem__(self, output: str) -> NDArray[Any]:
        if output not in self.trajectory.columns:
            raise KeyError(f"{output!r} -- expected one of {', '.join(self.trajectory.columns)}")
        return self.trajectory.columns[output]

    def summary(self) -> str:
        """Errors by output as text."""
        if not self.agreement:
            outputs = ", ".join(self.trajectory.columns)
            return f"{self.record.name} has none of the outputs {outputs}: nothing to compare"
        heading = ("channel", "RMSE", "offset", "RMSE about it", "peak to peak of error", "RMSE/std")
        rows = [
            (
                name,
                *(display(a.unit)(x, 4) for x in (a.rmse, a.offset, a.shape_rmse, a.peak_to_peak_error)),
                f"{a.nrmse:.3g}",
            )
            for name, a in self.agreement.items()
        ]
        return text_table(heading, rows)

    def to_frame(self) -> pd.DataFrame:
        """Outputs over time, with header cells ``name [unit]``."""
        import pandas as pd

        found = self.trajectory
        columns = {f"{name} [{found.units[name]}]": values for name, values in found.columns.items()}
        return pd.DataFrame(columns, index=pd.Index(found.time, name="time [s]"))

    def figure(self, channel: str | None = None) -> Figure:
        """One output over time beside its measurement, where there is one.

        Parameters
        ----------
        channel : str, optional
            An output; without it the first measured one.
        """
        from ..report.figures import Line, time_figure

        name = channel or next(iter(self.agreement), next(iter(self.trajectory.columns)))
        show = display(self.trajectory.units[name])
        lines = [Line("simulated", self.trajectory.time, show.factor * self[name])]
        if name in self.agreement:
            lines.append(Line("measured", self.record.time, show.factor * self.record.columns[name], dashed=True))
        return time_figure(lines, f"{name}, run {self.record.name}", show.unit)

    def write(self, path: str | os.PathLike[str]) -> Path:
        """Write the outputs (``.csv``, ``.csv.gz`` or ``.parquet``) and return the path."""
        return write_trajectory(Path(path), self.trajectory)

    def as_json(self) -> dict[str, Any]:
        """The JSON contract of ``simulate``."""
        channels = {name: asdict(a) for name, a in self.agreement.items()}
        return {"channels": channels, "steps": self.trajectory.time.size - 1, "wall_s": self.wall_s}

    def _repr_html_(self) -> str:
        return preformatted(self.summary())


def simulate(
    what: ModelLike,
    run: RunLike,
    *,
    values: Mapping[str, Value] | None = None,
    cutoff: float | None = None,
    isolate: bool | None = None,
    time_limit: float = TIME_LIMIT,
) -> SimulateResult:
    """Replay a measured run through an FMU, a model card or a model.

    Parameters
    ----------
    what : str, path, ModelCard, Kernel or result
        A file that ends in ``.fmu``, or a model as `identify` takes it. A card uses the run's own values where it
        holds them.
    run : path, Record or DataFrame
        Its inputs drive the model; outputs that it holds are compared.
    values : mapping of str to value, optional
        Parameter values by public name, SI; of an FMU any start value.
    cutoff : float, optional
        Cut-off [Hz] where v and a are derived from x.
    isolate : bool, optional
        Whether an FMU runs in a process of its own, which it may crash or hang without harm here; without it if it
        is not ours.
    time_limit : float
        Longest time of one call of an FMU there [s].

    Returns
    -------
    SimulateResult

    Raises
    ------
    InputError
        What cannot be read, inputs that the run has not, a value out of bounds.
    SimulationStopped, SimulationInterrupted
        An FMU that stopped early: ``trajectory`` has the rows until then.
    """
    (record,) = records_of(run)
    begun = time.perf_counter()
    if isinstance(what, (str, os.PathLike)) and os.fspath(what).endswith(".fmu"):
        with simulation(isolate, time_limit) as there:
            result = there.replay(Path(what), record, parameters=values, cutoff=cutoff)
    else:
        result = _model_run(what, record, values or {}, cutoff)
    wall = time.perf_counter() - begun
    return SimulateResult(result, agreement(result.time, result.columns, record), record, wall)


def _model_run(what: ModelLike, record: Record, values: Mapping[str, Any], cutoff: float | None) -> Trajectory:
    if isinstance(what, (str, os.PathLike)):
        text = os.fspath(what)
        if any(mark in text for mark in "/\\.") and not text.endswith(".toml"):
            raise InputError(
                f"{text!r} -- expected a file that ends in .fmu or .toml, or MODEL[:PRESET][+EFFECT...] "
                "-- correct the name"
            )
    resolved = resolve_model(what)
    model, p = resolved.kernel, resolved.params(values, record.name)
    units = {v.name: v.quantity.unit for v in model.outputs}
    check_measured(record, units)
    inputs = kernel_inputs(record, model, cutoff)
    y = model.simulate(p, record.time, inputs.values)
    columns = {v.name: y[:, k] for k, v in enumerate(model.outputs)}
    notes = (*inputs.notes, *cutoff_note(cutoff, [record], [v.name for v in model.inputs]))
    return Trajectory(record.time, columns, units, messages=notes)
