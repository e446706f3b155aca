"""One verb run in a process of its own, which tells how far it is and can be ended."""

from __future__ import annotations

import multiprocessing
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from ..logs.record import read_record
from ..models.contract import InputError
from ..verbs.diagnose import diagnose
from ..verbs.export import export
from ..verbs.identify import identify

Maps = Mapping[str, str]


@dataclass(frozen=True)
class Request:
    """What to run: ``identify`` or ``diagnose``, a model, and logs with the mapping of each.

    Attributes
    ----------
    verb, model : str
    runs, holdout : sequence of (Path, mapping)
    folder : Path
        Where card, FMU and report are written.
    """

    verb: str
    model: str
    runs: Sequence[tuple[Path, Maps]]
    holdout: Sequence[tuple[Path, Maps]]
    folder: Path


@dataclass
class Job:
    """A request under way: its steps so far, and its state: running, done, failed or cancelled."""

    number: int
    request: Request
    state: str = "running"
    steps: list[str] = field(default_factory=list)
    result: dict[str, Any] = field(default_factory=dict)
    _process: Any = None

    def start(self) -> None:
        """Start the process and listen to it."""
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe(duplex=False)
        self._process = context.Process(target=work, args=(theirs, self.request), daemon=True)
        self._process.start()
        theirs.close()
        threading.Thread(target=self._listen, args=(ours,), daemon=True).start()

    def cancel(self) -> None:
        """End the process; what it had not written is lost."""
        if self.state == "running":
            self.state = "cancelled"
            self._process.kill()

    def as_json(self) -> dict[str, Any]:
        """State, steps, result and the files to download."""
        files = sorted(p.name for p in self.request.folder.glob("*") if p.is_file()) if self.state == "done" else []
        return {
            "number": self.number, "verb": self.request.verb, "model": self.request.model, "state": self.state,
            "steps": list(self.steps), "files": files, **self.result,
        }  # fmt: skip

    def _listen(self, pipe: Connection) -> None:
        try:
            while True:
                kind, said = pipe.recv()
                if kind == "step":
                    if said not in self.steps[-1:]:
                        self.steps.append(said)
                elif self.state == "running":
                    self.result, self.state = said, kind
        except (EOFError, OSError):
            if self.state == "running":
                self.result, self.state = {"error": "the process ended before its answer -- try again"}, "failed"
        self._process.join()


def work(pipe: Connection, request: Request) -> None:
    """Run the verb and tell steps and answer through the pipe."""

    def step(text: str) -> None:
        pipe.send(("step", text))

    try:
        step("reading the logs")
        runs, holdout = ([read_record(p, mapping=m) for p, m in group] for group in (request.runs, request.holdout))
        verb = _diagnose if request.verb == "diagnose" else _identify
        pipe.send(("done", verb(request, runs, holdout, step)))
    except InputError as wrong:
        pipe.send(("failed", {"error": str(wrong)}))


def _identify(request: Request, runs: Any, holdout: Any, step: Callable[[str], None]) -> dict[str, Any]:
    found = identify(
        request.model, runs, holdout=holdout, progress=lambda p: step(f"{p.phase} ({p.number} of {p.phases})")
    )
    step("card, FMU, report")
    request.folder.mkdir(parents=True, exist_ok=True)
    found.write_card(request.folder / "card.toml")
    found.write_report(request.folder / "report.html")
    export(found, request.folder / "model.fmu")
    errors = [
        {"role": role, "channel": channel, "unit": score.unit, "rmse": score.rmse}
        for role, scores in (("measured", found.fit.measured), ("holdout", found.fit.holdout))
        for channel, score in scores.items()
    ]
    return {"answer": found.summary(), "errors": errors}


def _diagnose(request: Request, runs: Any, holdout: Any, step: Callable[[str], None]) -> dict[str, Any]:
    found = diagnose(request.model, runs, holdout=holdout, out=request.folder, progress=step)
    errors = [
        {"role": role, "channel": channel, "unit": gap.unit, "rmse": value}
        for channel, gap in found.gap.items()
        for role, value in (("measured", gap.after), ("holdout", gap.holdout_after))
        if value is not None
    ]
    return {"answer": found.answer, "errors": errors}
