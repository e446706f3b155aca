"""The data gate: what is in a measured run before anything is fitted to it."""

from .finding import Finding
from .run_check import Channel, RunCheck, check_record
from .spikes import spikes, without_spikes

__all__ = ["Channel", "Finding", "RunCheck", "check_record", "spikes", "without_spikes"]
