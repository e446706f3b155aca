"""Tendon-sheath drives as FMI units: models, identification, diagnosis, co-simulation."""

from .models.contract import InputError

__all__ = ["InputError"]
__version__ = "0.1.0"
