"""What is compiled ahead serves another process: nothing is compiled a second time."""

import os
import subprocess
import sys

from tsm_fmu.kernels import precompile
from tsm_fmu.kernels.compiled_cache import VARIABLE

SIMULATED = """
import numpy as np
from tsm_fmu.kernels.kernel import compiled_run, kernel
k = kernel("PairedTsmBacklash")
k.simulate(k.params(), [0.0, 0.1, 0.2], np.array([[0.0], [0.3], [0.1]]))
stats = compiled_run(k.module).stats
print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))
"""


def test_a_simulation_in_another_process_finds_its_compiled_form(tmp_path):
    number = [m.NAME for m in precompile._MODULES].index("PairedTsmBacklash")
    ahead = f"from tsm_fmu.kernels import precompile; precompile._compile({number})"
    found = []
    for text in (SIMULATED.replace("k.simulate", "0 and k.simulate"), ahead, SIMULATED):
        environment = {**os.environ, VARIABLE: str(tmp_path)}
        done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, env=environment)
        assert done.returncode == 0, done.stderr
        found.append(done.stdout.split())
    assert found == [["0", "0"], [], ["1", "0"]]


def test_no_folder_to_keep_anything_in_is_no_failure(monkeypatch):
    monkeypatch.setattr(precompile, "folder", lambda: None)
    assert precompile.main() == 0
