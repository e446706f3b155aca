"""Do et al., ICINCO 2013: Dahl-like friction."""
