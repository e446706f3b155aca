"""From runs that a model does not explain to the effect that it misses; ``docs/diagnosis.md`` says how it decides.

Rooms, each of which imports those before it:

* ``criteria``: every threshold, with its reason. ``evidence``, ``result``: what is found, as plain data.
* ``runs``: are the runs good enough, from where on are they compared, what moves in them.
* ``residual``: where a residual is, how much of it is a law of the motion, and a formula for that.
* ``fits``: a model with effects against runs (`Fitted`): refits, one linear step for a candidate, nuisance effects.
* ``choice``: sets of effects (`Hypothesis`), the search for them, and which of them the runs support.
* ``answer``: verdict, gaps, candidates, next motion, and the sentence. ``workflow``: all of it, in order.
* ``report``: the files.

Words: an *effect* is a term that a model may miss, a *candidate* an effect at a place of the model, a *hypothesis* a
set of effects refitted with the model. *Nuisance effects* are what every rig has a little of, so that every refit may
use them. A *gap* is the RMS of measured minus simulated; the *floor* is what of it nothing can explain; *closure* is
the share above the floor that is gone. *Reference runs* lack the missing effect, *held-out* runs are only judged.
"""
