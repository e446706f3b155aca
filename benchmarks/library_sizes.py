"""Size of every library of native FMUs: all models, and chains with effects, for each platform of FMI 3.0.

``python -m benchmarks.library_sizes [MODEL[+effect+...] ...]``; without names all models and `CHAINS`. Those of FMI 2.0
are smaller: fewer functions. Several minutes; the exit code is 1 where a library reaches the limit.
"""

from __future__ import annotations

import sys
import zipfile
from pathlib import Path
from tempfile import TemporaryDirectory

from tsm_fmu.fmu.build import build_fmu
from tsm_fmu.fmu.native.zig import LIMIT
from tsm_fmu.kernels.chain import chain
from tsm_fmu.models import MODELS

CHAINS = (
    "DistalEstimator+load_dependence+coulomb+backlash@x_out+sensor_lag@x_in",
    "TendonDrive+stribeck+backlash@x_out",
    "LebusCompensator+backlash+sensor_lag",
    "LebusCompensator+smooth_backlash+sensor_lag+delay",
    "LebusCompensator+smooth_backlash+sensor_lag+delay+backlash",
    "LebusTransmission+smooth_backlash+delay",
    "DcMotor+smooth_backlash+delay",
)
"""With a load that is solved for, of the drive, and on the largest models."""


def main(texts: list[str]) -> int:
    """Print kilobytes by unit and platform."""
    worst = 0
    for text in texts or [*(m.NAME for m in MODELS), *CHAINS]:
        model, *effects = text.split("+")
        with TemporaryDirectory(prefix="tsm_fmu_bench_") as folder:
            path = build_fmu(chain(model, tuple(effects)), Path(folder) / "Unit.fmu", flavour="native", fmi=3)
            with zipfile.ZipFile(path) as archive:
                sizes = {i.filename.split("/")[1]: i.file_size for i in archive.infolist() if "binaries/" in i.filename}
        worst = max(worst, *sizes.values())
        print(f"{text:<72} {'  '.join(f'{where} {size / 1000:.1f}' for where, size in sizes.items())}", flush=True)
    print(f"largest {worst / 1000:.1f} kB, limit {LIMIT / 1000:.0f} kB")
    return int(worst >= LIMIT)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
