"""The models, one file each. `MODELS` is the registry: tests, FMU build and command line iterate over it."""

from . import (
    dc_motor,
    distal_estimator,
    feedforward_compensator,
    lebus_transmission,
    lebus_winding,
    lugre_friction,
    paired_tsm_backlash,
    paired_tsm_friction,
    pid_controller,
    reference_signal,
    rotational_load,
    single_tsm_bouc_wen,
    single_tsm_dahl,
    single_tsm_lugre,
    sum,
    tendon_drive,
)

MODELS = (
    single_tsm_dahl,
    single_tsm_bouc_wen,
    single_tsm_lugre,
    paired_tsm_friction,
    paired_tsm_backlash,
    feedforward_compensator,
    lugre_friction,
    lebus_winding,
    lebus_transmission,
    tendon_drive,
    distal_estimator,
    dc_motor,
    pid_controller,
    rotational_load,
    reference_signal,
    sum,
)
