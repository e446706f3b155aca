"""Command line: one verb, one file. ``tsm-fmu`` and ``python -m tsm_fmu`` start here."""

from . import build, check, demo, diagnose, export, identify, list_models, reproduce, run, simulate, validate
from .app import app, main

VERBS = (check, demo, build, validate, list_models, identify, diagnose, simulate, export, run, reproduce)

__all__ = ["VERBS", "app", "main"]
