"""Every figure and number of the five papers: as printed, computed in this run, verdict, reason."""

from .run import Reproduction, reproduce
from .write import write_reproduction

__all__ = ["Reproduction", "reproduce", "write_reproduction"]
