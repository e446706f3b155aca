"""A million lives and ten million steps of each model's native unit in a host in C: does the process grow?

``python -m benchmarks.soak [MODEL ...]``; some minutes. The tests do this in full for TendonDrive and shortly for all.
The exit code is 1 where memory grows by 100 kB or a call fails.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from system_tests.test_native_platforms import built, host_of
from tsm_fmu.models import MODELS

LIVES, STEPS, LIMIT_KB = 1_000_000, 10_000_000, 100


def main(names: list[str]) -> int:
    """Print the growth of each."""
    failed = False
    for name in names or [m.NAME for m in MODELS]:
        with TemporaryDirectory(prefix="tsm_fmu_bench_") as place:
            folder = Path(place)
            path, library = built(name, 2, "linux64", folder)
            program = host_of(path, library, 2, ["gcc", "-O1", "-ldl"], folder / "host", LIVES=LIVES, STEPS=STEPS)
            done = subprocess.run([str(program)], capture_output=True, text=True)
        well = done.returncode == 0 and int(done.stdout) < LIMIT_KB
        failed |= not well
        print(f"{name:<22} {done.stdout.strip()} kB{'' if well else '  OVER'}", flush=True)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
