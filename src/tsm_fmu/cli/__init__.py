"""Command line: one verb, one file. ``tsm-fmu`` and ``python -m tsm_fmu`` start here."""

import os
import sys

os.environ["OPENBLAS_NUM_THREADS"] = os.environ.get("OPENBLAS_NUM_THREADS", "1")
# Before numpy is loaded: the matrices of a fit are small, and BLAS threads that wait for each other cost several fits.

try:
    from . import (
        batch,
        build,
        check,
        demo,
        diagnose,
        export,
        identify,
        linearize,
        list_models,
        local_page,
        monte_carlo,
        report,
        reproduce,
        run,
        sample,
        simulate,
        step_study,
        sweep,
        track,
        validate,
    )
    from .app import app, main
except KeyboardInterrupt:  # while the program loads
    sys.stderr.write("tsm-fmu: interrupted\n")
    raise SystemExit(130) from None

VERBS = (
    sample,
    check,
    demo,
    build,
    validate,
    list_models,
    identify,
    diagnose,
    track,
    batch,
    simulate,
    export,
    run,
    reproduce,
    sweep,
    monte_carlo,
    linearize,
    step_study,
    report,
    local_page,
)

__all__ = ["VERBS", "app", "main"]
