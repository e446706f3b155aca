"""Command line: one verb, one file. ``tsm-fmu`` and ``python -m tsm_fmu`` start here."""

from . import list_models
from .app import app, main

__all__ = ["app", "list_models", "main"]
