"""Bring the table of ``fmus/README.md`` up to date and write the FMUs to ``fmus/dist/``."""

from __future__ import annotations

import re
from pathlib import Path

from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.fmu.validate import validate_fmu
from tsm_fmu.kernels.kernel import Kernel
from tsm_fmu.models import MODELS

FOLDER = Path(__file__).parents[1] / "fmus"
TABLE = re.compile(r"(?<=<!-- table -->\n).*(?=<!-- end of table -->)", re.DOTALL)


def main() -> None:
    """Write table and FMUs; stop at the first FMU with a problem."""
    readme = FOLDER / "README.md"
    readme.write_text(with_table(readme.read_text()))
    for module in MODELS:
        fmu = build_fmu(Kernel(module), FOLDER / "dist")
        problems = validate_fmu(fmu)
        print(f"{fmu.relative_to(FOLDER.parent)}  {fmu.stat().st_size / 1000:.0f} kB")
        if problems:
            raise SystemExit("\n".join(problems))


def with_table(readme: str) -> str:
    """The README with its table of FMUs brought up to date."""
    rows = ["| FMU | what | inputs | outputs | parameters |", "|---|---|---|---|---|"]
    for module in MODELS:
        k = Kernel(module)
        summary = (module.__doc__ or "").strip().splitlines()[0].rstrip(".")
        cells = [f"`{v.name}` [{v.quantity.unit}]" for v in (*k.inputs, *k.outputs)]
        inputs, outputs = ", ".join(cells[: len(k.inputs)]), ", ".join(cells[len(k.inputs) :])
        parameters = ", ".join(v.name for v in k.parameters)
        rows.append(f"| {k.name} | {summary} | {inputs} | {outputs} | {parameters} |")
    return TABLE.sub(lambda _: "\n".join(rows) + "\n", readme)


if __name__ == "__main__":
    main()
