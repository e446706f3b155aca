"""The models, one file each. `MODELS` is the registry: tests, FMU build and command line iterate over it."""

from . import dc_motor, paired_tsm_backlash, pid_controller, reference_signal, rotational_load, sum

MODELS = (
    paired_tsm_backlash,
    dc_motor,
    pid_controller,
    rotational_load,
    reference_signal,
    sum,
)
