"""Make the shipped sample logs ``src/tsm_fmu/data/sample_*.csv.gz``: ``python build_scripts/make_sample_log.py``.

The plant is on purpose none of the package's models and shares no code with them:

* lost motion: a Prandtl-Ishlinskii sum of plays of different widths, Eq (1);
* elastic wind-up: the tendon gives way in proportion to the output torque, Eq (2);
* friction torque: Maxwell-slip elements (elastic-plastic springs in parallel) whose sliding level falls and
  rises with speed (Stribeck and viscous) and grows with the load, Eq (3);
* measurement: coloured torque noise, converter steps, and encoders of 8192 and 4000 counts a turn.

    x_c     = sum_i w_i P_ri[x_in],  P_r[x] = max(x - r, min(x + r, P_r before))              (1)
    x_out   = x_c - tau_out / k_w + x_off,  tau_out = tau_b + k_l (x_out - x_off) + d_l v     (2)
    tau_in  = g tau_out + sum_i q_i S_si[x_in] L(v) (1 + m |tau_out|)                         (3)
    S_s[x]  = max(-1, min(1, S_s before + dx / s)),  L(v) = 1 + e exp(-|v| / v_s) + f |v|
"""

from __future__ import annotations

import argparse
import gzip
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

FloatArray = NDArray[np.float64]
SEED = 20150927
RATE = 500.0
DURATION = 20.0
DEG = np.pi / 180.0

WEIGHTS = np.array([0.353, 0.214, 0.187, 0.112, 0.061])
PLAYS = np.array([0.0, 0.42, 0.97, 2.13, 3.61]) * DEG
SHARES = np.array([0.0131, 0.0087, 0.0049])
SLIPS = np.array([0.31, 1.07, 2.9]) * DEG
K_WINDUP, K_LOAD, D_LOAD, TAU_BIAS, X_OFFSET = 1.73, 0.0371, 0.0023, 0.0417, -0.337
GEAR, STRIBECK, V_STRIBECK, VISCOUS, LOAD_SHARE = 0.917, 0.23, 0.071, 0.19, 6.3
TORQUE_STEP, TORQUE_NOISE, NOISE_POLE = 6.1e-5, 4.3e-4, 0.86
COUNTS_IN, COUNTS_OUT = 8192, 4000

MOTIONS = {  # amplitude [deg], frequency [Hz], phase [rad]
    "sample_sine": ((29.3, 0.247, 0.0),),
    "sample_multisine": ((17.1, 0.173, 0.4), (8.7, 0.431, 2.1), (3.9, 0.887, 4.4)),
}


def reference(time: FloatArray, sines: tuple[tuple[float, float, float], ...]) -> FloatArray:
    """Drive angle [rad]: rest for 0.4 s, then sines that grow to full size over 1.2 s."""
    s = np.clip((time - 0.4) / 1.2, 0.0, 1.0)
    grown = s * s * (3.0 - 2.0 * s)
    return grown * sum(a * DEG * np.sin(2.0 * np.pi * f * (time - 0.4) + phase) for a, f, phase in sines)


def plant(x_in: FloatArray, dt: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """True tau_in, x_out and tau_out for a drive angle; Eq (1) to (3)."""
    v = np.gradient(x_in, dt)
    plays, slips = np.full_like(PLAYS, x_in[0]), np.zeros_like(SLIPS)
    x_c, friction = np.empty_like(x_in), np.empty_like(x_in)
    before = x_in[0]
    for k, x in enumerate(x_in):
        plays = np.maximum(x - PLAYS, np.minimum(x + PLAYS, plays))
        slips = np.clip(slips + (x - before) / SLIPS, -1.0, 1.0)
        x_c[k], friction[k], before = WEIGHTS @ plays, SHARES @ slips, x
    drag = D_LOAD * np.gradient(x_c, dt)
    bent = (x_c - (TAU_BIAS + drag) / K_WINDUP) / (1.0 + K_LOAD / K_WINDUP)
    tau_out = TAU_BIAS + K_LOAD * bent + drag
    level = 1.0 + STRIBECK * np.exp(-np.abs(v) / V_STRIBECK) + VISCOUS * np.abs(v)
    tau_in = GEAR * tau_out + friction * level * (1.0 + LOAD_SHARE * np.abs(tau_out))
    return tau_in, bent + X_OFFSET, tau_out


def measured(name: str) -> tuple[FloatArray, FloatArray]:
    """Time [s], and columns x_in, tau_in, x_out, tau_out as the sensors give them."""
    noise = np.random.default_rng([SEED, list(MOTIONS).index(name)])
    time = np.arange(round(RATE * DURATION) + 1) / RATE
    x_in = reference(time, MOTIONS[name])
    tau_in, x_out, tau_out = plant(x_in, 1.0 / RATE)

    def torque(true: FloatArray) -> FloatArray:
        white = TORQUE_NOISE * np.sqrt(1.0 - NOISE_POLE**2) * noise.standard_normal(time.size)
        coloured = np.asarray(lfilter([1.0], [1.0, -NOISE_POLE], white))
        return TORQUE_STEP * np.round((true + coloured) / TORQUE_STEP)

    def encoder(true: FloatArray, counts: int) -> FloatArray:
        step = 2.0 * np.pi / counts
        return step * np.floor(true / step + 0.37)

    columns = (encoder(x_in, COUNTS_IN), torque(tau_in), encoder(x_out, COUNTS_OUT), torque(tau_out))
    return time, np.column_stack(columns)


def main() -> None:
    """Write both logs."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "src" / "tsm_fmu" / "data")
    out: Path = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    for name in MOTIONS:
        time, columns = measured(name)
        lines = ["time [s],x_in [rad],tau_in [N.m],x_out [rad],tau_out [N.m]"]
        lines += [f"{t:.3f}," + ",".join(f"{value:.6f}" for value in row) for t, row in zip(time, columns, strict=True)]
        path = out / f"{name}.csv.gz"
        path.write_bytes(gzip.compress(("\n".join(lines) + "\n").encode(), mtime=0))
        print(path, path.stat().st_size)


if __name__ == "__main__":
    main()
