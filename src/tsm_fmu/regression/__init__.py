"""Regression of a model's parameters on measured runs, under both identification and diagnosis.

A `problem.Problem` says what is fitted to what: runs, channels, weights and a `search_space.SearchSpace`; it never
changes. A `solver.Solver` minimises its residuals: `descent.Descent` from one start, `multistart.MultiStart` from
several. `sensitivity` has every finite difference, `uncertainty` and `intervals` say how well the parameters are
known, `residuals` what is left, `held_out` judges runs that were not fitted.
"""
