"""The sample logs that come with the package."""

from __future__ import annotations

from importlib.resources import as_file, files

from ..logs.record import Record, read_record
from ..models.contract import InputError

SAMPLES = {"sine": "sample_sine.csv.gz", "multisine": "sample_multisine.csv.gz"}
"""File by name; made by ``build_scripts/make_sample_log.py`` from a plant that is none of our models."""


def sample(name: str) -> Record:
    """A sample log of a paired tendon-sheath drive.

    Parameters
    ----------
    name : {'sine', 'multisine'}

    Raises
    ------
    InputError
        Another name.
    """
    if name not in SAMPLES:
        raise InputError(f"sample {name!r} -- expected one of {', '.join(SAMPLES)} -- choose one")
    with as_file(files("tsm_fmu") / "data" / SAMPLES[name]) as path:
        return read_record(path)
