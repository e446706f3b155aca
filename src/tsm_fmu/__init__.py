"""Tendon-sheath drives as FMI units: models, identification, diagnosis, co-simulation.

>>> import tsm_fmu as tsm
>>> model = tsm.identify("PairedTsmBacklash", tsm.sample("sine"), holdout=tsm.sample("multisine"))

What is public stands in ``__init__.pyi``; each name is loaded when it is first used.
"""

import lazy_loader

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
