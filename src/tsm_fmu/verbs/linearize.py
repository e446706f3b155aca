"""``linearize``: a unit or a loop about a working point, as a linear system of python-control."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import __version__
from ..cosim.derivatives import has_derivatives
from ..cosim.description import describe
from ..cosim.isolation import Simulations, simulation
from ..cosim.linearize import Linear, Margins, margins, named
from ..cosim.linearize import linearize as linearize_case
from ..cosim.ssp import Case
from ..cosim.system import Component, Experiment, System
from ..logs.whole_file import check_folder
from ..models.contract import InputError
from ..report import Line, Section, Table, write_report
from ..report.figures import Figure
from ..report.panel import Panel
from ..report.text import preformatted, text_table
from . import TIME_LIMIT
from .systems import Settings, opened

if TYPE_CHECKING:
    from collections.abc import Iterator

    import pandas as pd

POINTS = 600
"""Frequencies of the Bode plot."""
DOUBTFUL = 0.01
"""From this asymmetry on a summary says that the system is not linear there."""


@dataclass(frozen=True)
class LinearizeResult:
    """A linear system about a working point; see `linearize`.

    Attributes
    ----------
    name : str
        What was linearised.
    inputs, outputs : tuple of str
        Between which ports.
    linear : Linear
        The system at the communication points; in continuous time where a unit gave its own derivatives.
    design : control.TransferFunction or None
        Open loop that a scenario was designed for.
    report : Path or None
        Page with the Bode plot.
    """

    name: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    linear: Linear
    design: Any = None
    report: Path | None = None

    @property
    def model(self) -> Any:
        """The state space of python-control (`control.StateSpace`), its ports by name with ``_`` for a dot."""
        return self.linear.model

    @cached_property
    def margins(self) -> Margins | None:
        """Margins, where one loop was open; `loops` has those of several."""
        return self.linear.margins() if self.linear.opened and self.linear.single else None

    @cached_property
    def design_margins(self) -> Margins | None:
        """Margins of the design in the same range of frequencies."""
        if self.design is None:
            return None
        omega = self._frequencies()
        return margins(np.asarray(self.design(1j * omega)), omega)

    @cached_property
    def loops(self) -> dict[str, Margins]:
        """Margins by input, of several loops open where their outputs return: of each with the others closed."""
        if self.linear.single:
            return {}
        return {name: self.linear.margins(k) for k, name in enumerate(self.inputs[: len(self.linear.returns)])}

    def _frequencies(self, points: int = 2000) -> np.ndarray[Any, np.dtype[np.float64]]:
        return np.geomspace(*self.linear.range, points)[:-1]

    @property
    def _ports(self) -> str:
        return f"{', '.join(self.inputs)} -> {', '.join(self.outputs)}"

    def margin_table(self) -> tuple[tuple[str, ...], list[tuple[str | float, ...]]]:
        """Heading and rows of the margins: of the loop and its design, or of each loop with the others closed."""
        columns = dict(self.loops)
        if self.margins is not None:
            columns["co-simulation"] = self.margins
            if self.design_margins is not None:
                columns["design"] = self.design_margins
        if not columns:
            return (), []
        fields = {
            "crossover": ("crossover", "rad/s"), "gain_margin_db": ("gain margin", "dB"),
            "phase_margin_deg": ("phase margin", "deg"), "delay_margin_s": ("delay margin", "s"),
        }  # fmt: skip
        rows = [
            (words, *(float(getattr(of, name)) for of in columns.values()), unit)
            for name, (words, unit) in fields.items()
        ]
        return ("margin", *columns, "unit"), rows

    def summary(self) -> str:
        """What was linearised, how well, and the margins, as text."""
        linear = self.linear
        how = "open" if linear.opened else "closed"
        lines = [f"{self.name}: {self._ports}, {how} at t = {linear.at:g} s, order {linear.model.nstates}, "]
        if linear.step > 0.0:
            lines[0] += f"step {linear.step:g} s; left by the model: {linear.unexplained:.1e}"
        else:
            lines[0] += "continuous, from the unit's own derivatives"
        if linear.asymmetry > DOUBTFUL:
            lines.append(
                f"not linear here: impulses up and down differ by {100 * linear.asymmetry:.2g} %; take another working "
                "point, a shorter --horizon or another --amplitude"
            )
        heading, rows = self.margin_table()
        if rows:
            if self.loops:
                lines.append("each loop with the others closed:")
            lines.append(text_table(heading, rows))
        return "\n".join(lines)

    def to_frame(self) -> pd.DataFrame:
        """Gain [dB] and phase [deg] over the frequency [rad/s]; of several ports each after their names."""
        import pandas as pd

        omega = self._frequencies(POINTS)
        response = np.reshape(self.linear.frequency_response(omega), (len(self.outputs), len(self.inputs), omega.size))
        columns: dict[str, Any] = {}
        for i, output in enumerate(self.outputs):
            for j, source in enumerate(self.inputs):
                prefix = "" if self.linear.single else f"{source} -> {output}: "
                columns[f"{prefix}gain [dB]"], columns[f"{prefix}phase [deg]"] = _bode(response[i, j])
        if self.design is not None:
            gain, phase = _bode(np.asarray(self.design(1j * omega)))
            columns |= {"design gain [dB]": gain, "design phase [deg]": phase}
        return pd.DataFrame(columns, index=pd.Index(omega, name="frequency [rad/s]"))

    def figure(self) -> Figure:
        """Bode plot, the design dashed beside it; of several ports a line from each input to each output."""
        table = self.to_frame()
        omega = table.index.to_numpy()
        panels = []
        for name in ("gain [dB]", "phase [deg]"):
            own = [column for column in table if column.endswith(name) and not column.startswith("design")]
            lines = [
                Line(column.removesuffix(name).removesuffix(": ") or "co-simulation", omega, table[column].to_numpy(),
                     colour=k)
                for k, column in enumerate(own)
            ]  # fmt: skip
            if self.design is not None:
                lines.append(Line("design", omega, table[f"design {name}"].to_numpy(), dashed=True, colour=1))
            panels.append(Panel("frequency [rad/s]", name, lines=lines, log_x=True, y_span=1.0))
        return Figure(f"Bode plot of {self._ports}", tuple(panels), common_x=True)

    def as_json(self) -> dict[str, Any]:
        """The JSON contract of ``linearize``."""
        linear, model = self.linear, self.linear.model
        return {
            "name": self.name, "inputs": self.inputs, "outputs": self.outputs, "units": linear.units, "at": linear.at,
            "open": linear.opened, "step": linear.step, "unexplained": linear.unexplained,
            "asymmetry": linear.asymmetry,
            **{n: np.asarray(getattr(model, n)).tolist() for n in ("A", "B", "C", "D")},
            "margins": None if self.margins is None else asdict(self.margins),
            "loops": {name: asdict(found) for name, found in self.loops.items()},
            "design": None if self.design_margins is None else asdict(self.design_margins),
            **({} if self.report is None else {"report": str(self.report)}),
        }  # fmt: skip

    def _repr_html_(self) -> str:
        return preformatted(self.summary()) + self.figure()._repr_html_()

    def _answer(self) -> str:
        found, asked = self.margins, self.design_margins
        if loops := self.loops:
            name, least = min(loops.items(), key=lambda item: item[1].phase_margin_deg)
            return (
                f"At t = {self.linear.at:g} s the least phase margin of {len(loops)} loops, each with the others "
                f"closed, is {least.phase_margin_deg:.3g} deg, of the loop at {name}, which crosses at "
                f"{least.crossover:.4g} rad/s."
            )
        if found is None:
            return " ".join(self.summary().splitlines()[: 1 + (self.linear.asymmetry > DOUBTFUL)])
        design = "" if asked is None else f" (design {asked.crossover:.4g} rad/s and {asked.phase_margin_deg:.3g} deg)"
        return (
            f"At t = {self.linear.at:g} s the loop as it runs crosses at {found.crossover:.4g} rad/s with "
            f"{found.phase_margin_deg:.3g} deg of phase margin{design}."
        )

    def write(self, folder: Path) -> Path:
        """Write the page into a folder and return its path."""
        heading, rows = self.margin_table()
        tables = [Table(heading, rows)] if rows else []
        text = (
            "Gain and phase at the communication points, from one period within the response up to half the sampling "
            "frequency. "
            "A system that is linear answers to impulses up and down alike; here the answers differ by "
            f"{100 * self.linear.asymmetry:.2g} %."
            if self.linear.step > 0.0
            else "Gain and phase of the unit's own directional derivatives at the working point, in continuous time."
        )
        section = Section("Frequency response", text, tables, [self.figure()])
        title, answer = f"{self.name}: {self._ports.replace('->', 'to')}", self._answer()
        return write_report(folder / "report.html", title, answer, [section], {"tsm-fmu": __version__})


def linearize(
    what: str | os.PathLike[str],
    at: float,
    *,
    input: str | Sequence[str] | None = None,
    output: str | Sequence[str] | None = None,
    closed: bool = False,
    out: str | os.PathLike[str] | None = None,
    values: Mapping[str, object] | None = None,
    case: Sequence[str] = (),
    step: float | None = None,
    jacobi: bool = False,
    loops: str | None = None,
    amplitude: float | None = None,
    horizon: float | None = None,
    order: int | None = None,
    isolate: bool | None = None,
    time_limit: float = TIME_LIMIT,
) -> LinearizeResult:
    """Linearise a unit or a loop about a working point.

    Parameters
    ----------
    what : str or Path
        Name of a scenario, or a file that ends in ``.ssp`` or ``.fmu``.
    at : float
        When the working point is reached [s].
    input, output : str or sequence of str, optional
        ``component.variable``, of an FMU the variable; without them those of the loop that a scenario was designed for.
        From several inputs to several outputs loops are open at all the inputs at once; where each output is what its
        input gets, in the same order, the margins of each loop with the others closed are found too.
    closed : bool
        Leave loops closed at the inputs: the response to disturbances that are added there.
    out : str or Path, optional
        Folder for the page; nothing is written without it.
    values, case, step, jacobi, loops, isolate, time_limit
        As in `run`; the first case without a name.
    amplitude, horizon, order
        As in `tsm_fmu.cosim.linearize.linearize`.

    Returns
    -------
    LinearizeResult

    Raises
    ------
    InputError
        No such scenario, file, case or port, or a response that tells nothing.
    """
    folder = None if out is None else check_folder(out)
    settings = Settings(values or {}, case, None, step, jacobi, loops, isolate, time_limit)
    with _system(what, folder, settings) as (name, one, module, go):
        usual = getattr(module, "DESIGNED", (None, None))
        prefix = "" if module is not None or not os.fspath(what).endswith(".fmu") else "unit."
        sources, targets = (
            [n if n.startswith(prefix) else prefix + n for n in ([given] if isinstance(given, str) else given or ())]
            for given in (input or usual[0], output or usual[1])
        )
        if not sources or not targets:
            raise InputError(f"{name} -- expected an input and an output -- give both")
        connected = {c.target for c in one[0].connections}
        opened_there = not closed and any(source in connected for source in sources)
        alone = len(one[0].components) == 1 and not one[0].connections
        if alone and amplitude is None and order is None and has_derivatives(describe(one[0].components[0].fmu)):
            linear = go.of_derivatives(one, sources, targets, at)
        else:
            linear = linearize_case(
                one, sources, targets, at, opened=opened_there, amplitude=amplitude, horizon=horizon, order=order,
                simulate=go.simulate_system,
            )  # fmt: skip
        designed = (*sources, *targets) == usual and linear.opened
        design = module.designed(one) if module is not None and designed else None
    names = (tuple(n.removeprefix(prefix) for n in sources), tuple(n.removeprefix(prefix) for n in targets))
    result = LinearizeResult(name, *names, replace(linear, model=named(linear.model, *names)), design)
    return result if folder is None else replace(result, report=result.write(folder))


@contextmanager
def _system(
    what: str | os.PathLike[str], folder: Path | None, settings: Settings
) -> Iterator[tuple[str, Case, Any, Simulations]]:
    """Name, system, scenario and where to simulate; an FMU is a system of its own."""
    if not os.fspath(what).endswith(".fmu"):
        with opened(what, folder, settings) as system:
            name, one = next(iter(system.cases.items()))
            yield name, one, system.scenario, system.there
        return
    path = Path(what)
    description = describe(path)
    usual = getattr(description.model.defaultExperiment, "stepSize", None)
    inputs = {p.name: p.start or 0 for p in description.inputs if p.kind == "Real"}
    given = {name.removeprefix("unit."): str(value) for name, value in settings.values.items()}
    system = System((Component("unit", path, {**inputs, **given}),), (), path.stem)
    with simulation(settings.isolate, settings.time_limit) as there:
        experiment = Experiment(stop=1.0, step=settings.step or float(usual or 1e-3))
        yield path.stem, (system, experiment), None, there


def _bode(response: Any) -> tuple[Any, Any]:
    size = np.abs(response)
    gain = 20.0 * np.log10(np.where(size > 0.0, size, np.nan))  # an input that an output does not hear of: no line
    return gain, np.degrees(np.unwrap(np.angle(response)))
