"""Every figure and number of the five papers: as printed, computed in this run, verdict, reason."""

from .run import Reproduction, ReproductionInterrupted, reproduce
from .write import write_reproduction

__all__ = ["Reproduction", "ReproductionInterrupted", "reproduce", "write_reproduction"]
