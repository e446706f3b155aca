"""One verb run in a process of its own, which tells how far it is and can be ended."""

from __future__ import annotations

import _thread
import multiprocessing
import os
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from ..logs.display import display
from ..logs.record import read_record
from ..models.contract import InputError
from ..verbs.diagnose import diagnose
from ..verbs.export import export
from ..verbs.identify import identify

Maps = Mapping[str, str]
PATIENCE = 20.0
"""Seconds that a cancelled job has to write what it found so far; then it is ended."""


@dataclass(frozen=True)
class Request:
    """What to run: ``identify`` or ``diagnose``, a model, and logs with the mapping of each.

    Attributes
    ----------
    verb, model : str
    runs, holdout, reference : sequence of (Path, mapping)
        ``reference`` is for a diagnosis.
    folder : Path
        Where card, FMU and report are written.
    """

    verb: str
    model: str
    runs: Sequence[tuple[Path, Maps]]
    holdout: Sequence[tuple[Path, Maps]]
    reference: Sequence[tuple[Path, Maps]]
    folder: Path


@dataclass
class Job:
    """A request under way: its steps so far, and its state: running, stopping, done, failed or cancelled."""

    number: int
    request: Request
    state: str = "running"
    steps: list[str] = field(default_factory=list)
    result: dict[str, Any] = field(default_factory=dict)
    _process: Any = None
    _stop: Any = None

    def start(self) -> None:
        """Start the process and listen to it."""
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe(duplex=False)
        listens, self._stop = context.Pipe(duplex=False)
        self._process = context.Process(target=work, args=(theirs, listens, self.request), daemon=True)
        self._process.start()
        theirs.close()
        listens.close()
        threading.Thread(target=self._listen, args=(ours,), daemon=True).start()

    def cancel(self) -> None:
        """Ask the process to keep what it has found and end; one that does not within `PATIENCE` is ended."""
        if self.state != "running":
            return
        self.state = "stopping"
        try:
            self._stop.send("stop")
        except OSError:  # it has just ended
            return
        ender = threading.Timer(PATIENCE, self._process.kill)
        ender.daemon = True
        ender.start()

    def end(self) -> None:
        """End the process now; what it had not written is lost."""
        if self.state in ("running", "stopping"):
            self.state = "cancelled"
            self._process.kill()

    def as_json(self) -> dict[str, Any]:
        """State, steps, result and the files to download."""
        ended = self.state in ("done", "cancelled")
        files = sorted(p.name for p in self.request.folder.glob("*") if p.is_file()) if ended else []
        return {
            "number": self.number, "verb": self.request.verb, "model": self.request.model, "state": self.state,
            "steps": list(self.steps), "files": files, **self.result,
        }  # fmt: skip

    def _listen(self, pipe: Connection) -> None:
        try:
            while True:
                kind, message = pipe.recv()
                if kind == "step":
                    if message not in self.steps[-1:]:
                        self.steps.append(message)
                elif self.state in ("running", "stopping"):
                    self.result, self.state = message, kind
        except (EOFError, OSError):
            if self.state == "running":
                self.result, self.state = {"error": "the process ended before its answer -- try again"}, "failed"
            elif self.state == "stopping":
                self.result, self.state = {"answer": NOTHING_KEPT}, "cancelled"
        self._process.join()


NOTHING_KEPT = "cancelled before there was anything to keep"


def work(pipe: Connection, stop: Connection, request: Request) -> None:
    """Run the verb and tell steps and answer through the pipe; what `stop` brings acts as Ctrl-C."""

    def step(text: str) -> None:
        pipe.send(("step", text))

    threading.Thread(target=_interrupt, args=(stop,), daemon=True).start()
    try:
        step("reading the logs")
        groups = (request.runs, request.holdout, request.reference)
        runs, holdout, reference = ([read_record(p, mapping=m) for p, m in group] for group in groups)
        if request.verb == "diagnose":
            pipe.send(_diagnose(request, runs, holdout, reference, step))
        else:
            pipe.send(_identify(request, runs, holdout, step))
    except InputError as wrong:
        pipe.send(("failed", {"error": str(wrong)}))
    except KeyboardInterrupt as stopped:
        pipe.send(("cancelled", {"answer": str(stopped).replace(f"{request.folder}{os.sep}", "") or NOTHING_KEPT}))


def _interrupt(stop: Connection) -> None:
    try:
        stop.recv()
    except (EOFError, OSError):  # the page is gone
        os._exit(1)
    _thread.interrupt_main()


Answer = tuple[str, dict[str, Any]]
"""State and what to show."""


def _identify(request: Request, runs: Any, holdout: Any, step: Callable[[str], None]) -> Answer:
    found = identify(
        request.model, runs, holdout=holdout, progress=lambda p: step(f"{p.phase} ({p.number} of {p.phases})")
    )
    step("card, FMU, report")
    request.folder.mkdir(parents=True, exist_ok=True)
    found.write_card(request.folder / "card.toml")
    found.write_report(request.folder / "report.html")
    export(found, request.folder / "model.fmu")
    errors = [
        {"role": role, "channel": channel, "rmse": display(score.unit)(score.rmse, 4)}
        for role, scores in (("measured", found.fit.measured), ("holdout", found.fit.holdout))
        for channel, score in scores.items()
    ]
    return "done" if found.complete else "cancelled", {"answer": found.summary(), "errors": errors}


def _diagnose(request: Request, runs: Any, holdout: Any, reference: Any, step: Callable[[str], None]) -> Answer:
    found = diagnose(request.model, runs, holdout=holdout, reference=reference, out=request.folder, progress=step)
    errors = [
        {"role": role, "channel": channel, "rmse": display(gap.unit)(value, 4)}
        for channel, gap in found.gap.items()
        for role, value in (("measured", gap.after), ("holdout", gap.holdout_after))
        if value is not None
    ]
    return "done", {"answer": found.answer, "errors": errors}
