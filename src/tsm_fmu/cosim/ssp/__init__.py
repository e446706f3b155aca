"""System Structure and Parameterization (SSP 1.0 and 2.0): systems with their FMUs in one archive.

Written is one system as SSP 1.0, in ``SystemStructure.ssd``: identifiers as names, one name for all parameter sets,
no nested systems. Read are nested systems, connectors of systems, signal dictionaries, parameter sets with prefixes,
units and mappings, and further ``.ssd`` files beside the first as variants.

Start and stop time are SSP's default experiment; what SSP has no place for (communication step, method, evaluation) is
an annotation of type ``tsm-fmu.experiment``; without it the step that another tool noted is taken, else the FMUs'.
"""

from .read import Case, open_ssp
from .write import write_ssp

__all__ = ["Case", "open_ssp", "write_ssp"]
