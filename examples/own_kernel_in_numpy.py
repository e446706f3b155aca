"""A model as a function of arrays: the loop of a paired tendon for three strokes, beside its closed form."""

import numpy as np

import tsm_fmu as tsm

model = tsm.kernel("PairedTsmBacklash")
p = model.params("published", {"alpha": 12.0})
time = np.linspace(0.0, 6.0, 3001)
for stroke in (0.1, 0.3, 0.9):
    y = model.simulate(p, time, stroke * np.sin(2.0 * time)[:, None])
    x_h = y[:, [v.name for v in model.outputs].index("x_h")]
    closed_form = abs(p.beta) / p.alpha * np.tanh(p.alpha * stroke)
    print(f"stroke {stroke:g} rad: half height {np.max(np.abs(x_h[1500:])):.5f} rad, closed form {closed_form:.5f} rad")
