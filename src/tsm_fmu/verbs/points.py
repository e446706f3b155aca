"""Points of co-simulations, for `sweep` and `monte_carlo`: run wherever there is room, kept as they come."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from ..batching.kept import Kept
from ..batching.run import run_batch
from ..cosim import sweep as sweeping
from ..cosim.isolation import Simulations
from ..cosim.progress import bar
from ..cosim.sweep import Axis, Change, Point, Values, Work
from ..models.contract import InputError
from .systems import Opened


@dataclass(frozen=True)
class How:
    """How points are run: `sweep` says what each of these means."""

    workers: int | None = None
    scheduler: str | None = None
    isolate: bool | None = None
    time_limit: float = 300.0
    progress: bool = False
    notes: Callable[[str], object] = lambda _: None


def run_points(
    system: Opened,
    axes: Sequence[Axis],
    points: Sequence[Values],
    folder: Path | None,
    how: How,
    *,
    changes: dict[tuple[str, ...], Change],
    settings: dict[str, str],
    traced: str = "",
    kind: str = "sweep",
) -> list[Point]:
    """All points in their order; those that an earlier call left in the folder are not run again.

    Raises
    ------
    InputError
        All points failed, or there is no place to work.
    KeyboardInterrupt
        Saying where the points until then are.
    """
    there = Simulations(how.isolate, how.time_limit)
    work = Work(system.cases, system.record, system.quantities, there.simulate_system, changes, settings, traced)
    kept = None if folder is None else Kept(folder / f"{kind}.points.jsonl", sweeping.identity(work, points))
    done = {} if kept is None else {n: Point.from_plain(plain) for n, plain in kept.results.items()}
    if done:
        how.notes(f"{len(done)} of {len(points)} points kept from a {kind} that did not end")

    def keep(number: int, point: Point) -> None:
        if kept is not None:
            kept.add(number, asdict(point))

    try:
        with bar(how.progress, f"{kind} {system.name}", len(points)) as advance:
            advance(len(done))
            run_batch(
                work, points, done, lost=sweeping.lost, keep=keep, workers=how.workers, scheduler=how.scheduler,
                advance=advance,
            )  # fmt: skip
    except KeyboardInterrupt:
        if not done or folder is None:
            raise
        data = sweeping.write_sweep(folder, system.name, axes, _ordered(done), complete=False, kind=kind)
        raise KeyboardInterrupt(f"interrupted; {len(done)} points kept in {data['results']}") from None
    finally:
        there.close()
    if kept is not None:
        kept.finish()
    return _some_good(_ordered(done))


def _some_good(points: list[Point]) -> list[Point]:
    if all(point.failed for point in points):
        raise InputError(f"all {len(points)} points failed, the first: {points[0].failed}")
    return points


def _ordered(done: dict[int, Point]) -> list[Point]:
    return [done[number] for number in sorted(done)]
