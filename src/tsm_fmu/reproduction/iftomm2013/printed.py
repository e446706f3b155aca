"""IFToMM 2013: the error that it prints."""

from ...scenarios.papers import ERROR_N
from ..printed import printed

ERROR = printed(f"{ERROR_N['iftomm2013']:g}", "N", "page 8")
