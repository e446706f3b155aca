"""Scenarios of ``tsm-fmu run``, one file each.

A scenario module has NAME, FMUS (model names), RECORD, ``cases(fmus)``, ``comparison(cases)``, what stands beside the
metrics in the JSON output, and ``write_scenario_report(path, runs, metrics, beside)``, where ``beside`` is the
comparison and, as ``ending``, the sections that end the report (commands, what the coupling costs); perhaps
``quantities(case, run)``: numbers of its own by name, each a `Metric` with its unit, for the metrics of the case.
"""

from . import (
    configuration_independence,
    lebus_drive,
    mssp_feedforward,
    single_tsm_drive,
    single_tsm_force,
    tendon_drive_loop,
)

SCENARIOS = {
    module.NAME: module
    for module in (
        mssp_feedforward,
        single_tsm_force,
        single_tsm_drive,
        lebus_drive,
        configuration_independence,
        tendon_drive_loop,
    )
}
