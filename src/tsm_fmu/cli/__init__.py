"""Command line: one verb, one file. ``tsm-fmu`` and ``python -m tsm_fmu`` start here."""

from . import build, export, identify, list_models, run, simulate, validate
from .app import app, main

__all__ = ["app", "build", "export", "identify", "list_models", "main", "run", "simulate", "validate"]
