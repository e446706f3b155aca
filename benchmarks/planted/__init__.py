"""Every effect planted in an easy log of every model and place where it makes sense: is it named?

The effects are written here, in another functional form or discretisation than in their files (`formulas`); the rigs
are the models themselves (`rigs`). Easy: rich motion, little noise, an effect of a good part of the channel. The blind
cases (`benchmarks.blind`) are the hard ones.
"""
