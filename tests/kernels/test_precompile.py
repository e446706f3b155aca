"""What is compiled ahead serves another process: nothing is compiled a second time."""

import os
import subprocess
import sys

import numpy as np

from tsm_fmu.kernels import precompile
from tsm_fmu.kernels.compiled_cache import VARIABLE
from tsm_fmu.kernels.kernel import compiled_loops, compiled_run, kernel
from tsm_fmu.models.contract import flat

SIMULATED = """
import numpy as np
from tsm_fmu.kernels.kernel import compiled_loops, kernel
k = kernel("PairedTsmBacklash")
k.simulate(k.params(), [0.0, 0.1, 0.2], np.array([[0.0], [0.3], [0.1]]))
stats = compiled_loops(k.module).stats
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


def test_arrays_that_may_not_be_written_to_and_strided_ones_take_the_same_compiled_form():
    k, time = kernel("PairedTsmBacklash"), np.array([0.0, 0.13, 0.29, 0.31])
    locked = time.copy()
    locked.flags.writeable = False
    moves = np.asfortranarray([[0.0], [0.37], [-0.11], [0.2]])
    k.simulate(k.params(), time, moves)
    run, found = compiled_run(k.module), []
    table = np.array([flat(k.params())])
    for t, u in ((time, moves), (locked, moves), (np.repeat(time, 2)[::2], np.repeat(moves, 2, axis=1)[:, ::2])):
        found.append(np.empty((4, len(k.outputs))))
        run(table, np.array([[0, 4, 0]]), t, u, found[-1], np.zeros(1, dtype=np.int64))
    assert len(compiled_loops(k.module).signatures) == 1
    np.testing.assert_array_equal(found, [found[0]] * 3)


def test_no_folder_to_keep_anything_in_is_no_failure(monkeypatch):
    monkeypatch.setattr(precompile, "folder", lambda: None)
    assert precompile.main() == 0
