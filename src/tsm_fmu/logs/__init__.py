"""Measured logs: reading, units, derivatives, quantisation, and how well a simulation agrees with them."""
