"""Refits of the model with candidates, nuisance parameters, and one linear step for each."""
