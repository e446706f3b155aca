"""Print what the models make of the logs of a da Vinci instrument: motion, drive torque, jaw from the drive alone.

``python -m benchmarks.davinci [motion] [torque] [estimator]``; without a name, all three (docs/davinci.md).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence

from . import davinci_estimator, davinci_motion, davinci_torque
from .davinci_data import data_folder, read_logs, splits

TABLES = ("motion", "torque", "estimator")


def rows(wanted: Sequence[str]) -> Iterator[str]:
    """Rows of the tables, computed as they are asked for."""
    folder = data_folder()
    logs, other_tool = read_logs(folder / "T4L4"), read_logs(folder / "T4L2")
    divisions = splits(logs)
    tables = {
        "motion": lambda: davinci_motion.table(logs, divisions),
        "torque": lambda: davinci_torque.table(divisions, other_tool),
        "estimator": lambda: davinci_estimator.table(logs, divisions, other_tool),
    }
    for name in wanted:
        yield from tables[name]()
        yield ""


def main(arguments: Sequence[str]) -> int:
    """Print the tables; 2 if there is no data or no such table."""
    if unknown := [a for a in arguments if a not in TABLES]:
        print(f"table {unknown[0]!r} -- expected some of {', '.join(TABLES)} -- none prints all", file=sys.stderr)
        return 2
    if not (data_folder() / "T4L4").is_dir() or not (data_folder() / "T4L2").is_dir():
        print(
            f"data folder {data_folder()} -- expected T4L4 and T4L2 in it -- set TSM_FMU_DATA to the folder that "
            "contains davinci/",
            file=sys.stderr,
        )
        return 2
    for line in rows(arguments or TABLES):
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
