"""The models, one file each. `MODELS` is the registry: tests, FMU build and command line iterate over it."""

from . import paired_tsm_backlash

MODELS = (paired_tsm_backlash,)
