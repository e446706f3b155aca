"""Criteria of the diagnosis: every threshold that decides what is said of a model, with its unit and its reason.

``*_SHARE`` is a part of what its sentence names; ``*_SPREAD_SHARE`` is an RMS as a part of the channel's spread (its
standard deviation within runs), ``*_RATIO`` one of two like quantities, ``*_DEVIANCE`` twice a difference of log
likelihoods. ``docs/diagnosis.md`` lists them (``build_scripts/write_criteria.py``). Constants that only say how finely
something is computed stand where it is computed.
"""

# Runs that can be judged

FEWEST_SAMPLES = 200
"""A run needs so many: with fewer, noise fits any law."""

STUCK_RUN_SHARE = 0.9
"""A channel that repeats one value over this part of a run measures nothing."""

CLIPPED_SHARE = 0.02
"""A channel that stands at its limit for more than this part of a run is not a measurement of the drive."""

LIMIT_TO_LEVEL_RATIO = 8.0
"""Samples at a limit over those at a level on average, beyond which it is a limit and not a level of a converter."""

FORGOTTEN_STROKE_SHARE = 0.1
"""A run is compared once the drive has moved by this part of its stroke, five presliding distances of the usual size:
until then its friction is that of a past which is not in the log."""

FORGOTTEN_TRAVEL_SHARE = 0.5
"""Nor is it compared later than after this part of the longest stroke, five presliding distances of the longest size: a
model that lacks an effect may take friction for a spring, and remembers for ever."""

LEFT_OUT_SHARE = 0.5
"""At most this part of a run is left out for that."""

REMEMBERED_SHARE = 0.05
"""A state at the start is fitted where it does this part of what it does in all of a run: what is forgotten wanders."""

SEARCH_SAMPLES = 4_000
"""The search works on so many samples of all runs together: refits take seconds, and parameters hardly change."""

SPEED_INPUT_SEARCH_SAMPLES = 8_000
"""The same where the input is a speed: a step then has the mean of the speeds that it stands for, which comes late."""

FEW_SAMPLES_RATIO = 2.0
"""A refit that leaves so many times as much on all samples has fitted what lies between those of the search: it takes
more."""

MORE_SAMPLES_RATIO = 4
"""So many times as many, until that is no longer so, or all are there."""

BETWEEN_SAMPLES_RATIO = 1.1
"""The refitted model and that of the answer are fitted to as many more if they leave so many times as much on all
samples: a damping that acts between those of the search may be anywhere."""

KEPT_RUN_SAMPLES = 500
"""A run keeps so many, however many runs there are."""

REST_SPEED_SHARE = 0.02
"""A speed below this part of its RMS is standing still: sensors and controllers hum."""

REST_WINDOW_S = 0.1
"""A measured speed that is not told from zero over such a time is zero: its noise would let a friction state slip."""

REST_DEVIATIONS = 3.0
"""Standard deviations of its noise, and of its mean over that time, within which it is not told from zero."""

UNRESOLVED_SPREAD_SHARE = 0.02
"""A value is in doubt where what the log does not say of the motion between two samples makes an error of more."""

DOUBT_DEVIATIONS = 8.0
"""It is then compared beyond so many standard deviations of that error: at a reversal the law of a rig is that of the
model only about, and a late channel is off by far more."""

UNRESOLVED_MOST_SHARE = 0.6
"""At most this part of a run is in doubt for that: a log that resolves less is compared as it is."""

LONG_STAY_RATIO = 8.0
"""A reading of an encoder that stays this many times longer than the ones beside it is a rest; at a reversal it stays
five times longer at most."""

PRESLIDING_STROKE_SHARE = (3e-4, 0.02, 0.1)
"""Shortest, usual and longest presliding distance that effects see, as parts of the longest stroke."""

EFFECT_OF_CHANNEL_SHARE = 0.5
"""A load whose variance is by more than this part a multiple of a compared force is a measurement of it, no cause."""

COPY_SHARE = 0.98
"""A load of which more is a multiple of another one says nothing new."""

POSITION_SHARE = 0.9
"""A column is the position that belongs to a speed if more of its moves is a multiple of the way of that speed."""

DITHER_SHARE = 0.01
"""Part of the samples at which a position goes to and fro, beyond which it has noise: its steps are then no speed."""

POSITION_NOISE_SHARE = 0.1
"""The same of its noise, as a part of what it moves in a sample."""

FRICTION_LEVEL_RATIO = 1.0
"""A level of the model's friction (Coulomb, break-away) is at most this many times the range, zero included, of the
channels that it is in: a motion that reverses shows twice its level, one that does not the level."""

FORGOTTEN_LENGTHS = 3.0
"""The longest stroke is at least this many lengths over which the model forgets a reversal: 5 % of it are left."""

# Nuisance parameters

NUISANCE_SPREAD_SHARE = 0.015
"""A nuisance parameter that removes more is an effect of its own: the clocks and zeros of good rigs differ by less.
One that removes a notable part where reference runs show those of the rig, or nearly all, must remove what any effect
must."""

SHAPE_SPREAD_SHARE = 0.045
"""The same of laws of what follows a reversal: rigs differ by as much, and a model has but one."""

REFERENCED_SHAPE_SPREAD_SHARE = 0.03
"""The same beside reference runs, and more than they remove there."""

UNLIKE_REFERENCE_RATIO = 2.0
"""Nor is a law the form of the model that leaves no more than the model does of reference runs, where without it this
many times that is left, and it removes this many times what it does there: the form of a rig stays."""

IDLE_SPREAD_SHARE = 0.002
"""A nuisance parameter that does less is left out of the answer's model: nobody would see it."""

LEVEL_STEP_SHARE = 0.05
"""Values lie on the levels of a converter if 99 of 100 are off by less than this part of a step: noise added behind it,
or the digits of the log. Of values spread evenly one of ten is."""

LEVEL_GAP_RATIO = 10.0
"""The least gap between two levels over the largest between two values of one: of values without levels neighbouring
gaps differ by far less."""

VALUES_OF_A_LEVEL = 10
"""On average, as many values at least are at each level: fewer are no levels but values apart."""

# Which hypothesis the runs support

EFFECT_SPREAD_SHARE = 0.012
"""What is left open, or taken by other values, is a gap beyond this part: less is within the form of any friction
model."""

CLEAN_EFFECT_SPREAD_SHARE = 0.006
"""An effect is not named if it removes less."""

FURTHER_EFFECT_SPREAD_SHARE = 0.025
"""One in a channel on which another acts is not named if it removes less: no law of the library is quite that of a rig,
and what the first lacks looks like a second."""

NOTABLE_RATIO = 0.4
"""An effect must remove this many times the mean square that is left with it: less may mend the form of the model."""

PARAMETER_RATIO = 0.08
"""By how many times the mean square that is left each parameter more must lower it, or the law may bend to the form of
the model."""

NEARLY_ALL_SHARE = 0.9
"""What removes this part of the mean square that another hypothesis leaves is no correction of a wrong form."""

LAW_FORM_SHARE = 0.03
"""A right name may leave this part of the mean square that it removes, because its law is not quite the true one."""

MUCH_LESS_RATIO = 0.5
"""Of two effects that look like each other the one that leaves less than this many times the mean square is there; an
effect that all others compare to like that is, though something is left."""

RIVAL_RATIO = 3.0
"""Where an answer leaves more than the floor, its law is not quite the rig's: an effect with no more parameters that
leaves less than this many times the mean square may be there instead, if it closes half as much."""

FIT_SPREAD_SHARE = 0.003
"""A difference between two fits that says nothing about which is right."""

CONVERGED_SHARE = 2e-3
"""Refits of the same model may end so far apart in mean square; rounding must not decide."""

DIFFERENCE_DEVIANCE = 8.0
"""Evidence that a difference between two hypotheses must make beyond noise: chance makes it in about one of 200."""

RIVAL_COST_RATIO = 1.3
"""Costs within this factor of the least are fits worth comparing to the last per cent."""

IMITATED_SHARE = 1e-3
"""A response of which less than this part is beyond the model's own parameters says nothing."""

SHAPE_RANGE_RATIO = 2.0
"""A refit may leave the range of the shapes tried by this factor: beyond, an effect has another one's signature."""

WIDTH_RATIO = 1.3
"""A refit may leave the range of widths by this factor: wider bursts run together, and are harmonics."""

CENTRED_SHARE = 0.5
"""Part of the stroke, about its middle, in which what stiffens both ways is zero: about another position its law is any
bend."""

CORE_SHARE = 0.5
"""Part of what an effect does that the sizes which make it must do: a winding without bursts is another law."""

REPEATED_SHARE = 1.0 / 3.0
"""Part of what a law of turns of unknown length explains that it must explain at angles that the runs pass in several
turns: a law at one place of the stroke comes once in turns that are long enough."""

STANDING_SHARE = 0.02
"""A sheath's angle, or a load, that varies by less of its mean stands still: what a rig is given changes it by many
times that, what measures it wanders less."""

STRONGEST_RATIO = 0.5
"""Where more than noise is left, the effect that removes most must remove this many times the mean square left."""

FURTHER_RATIO = 1.0
"""A further effect must remove this many times the mean square left: less may only mend the form of the first's law."""

# How far the search goes

MOST_EFFECTS = 3
"""Effects in a hypothesis, and in an answer: with more, almost any gap can be closed."""

REFITTED_CANDIDATES = 8
"""Candidates refitted, of those that one linear step ranks best, the last of them the best that is left with a single
parameter: it may be ranked behind laws that bend to anything."""

CONTENDING_RATIO = 2.0
"""Of these, those are refitted to the end that after the first steps leave at most this many times the mean square that
the best one leaves: later steps seldom halve it. And what hides behind one of them up to `EARLY_RATIO`: the first
steps lead a law of more shapes less far."""

PROMISING_RATIO = 1.05
"""A rival that is refitted from the values of the best is given up where its first steps leave this many times what it
left before: later ones seldom gain as much."""

EARLY_RATIO = 4.0
"""Of many samples those that leave this many times what the best one leaves are left out after two steps."""

REFERENCE_GAIN_SHARE = 0.02
"""On reference runs a candidate is refitted to the end if its first steps there gain this part of the mean square that
the measured runs leave: less changes no choice, even if later steps double it."""

PLACES_OF_AN_EFFECT = 2
"""Places of one effect among these."""

PROBED_CANDIDATES = 8
"""Candidates for a further effect that a few steps of a refit probe: each is a chain to compile."""

FURTHER_CANDIDATES = 4
"""Of these, so many are refitted, and one more for each nuisance parameter that is an effect."""

SWAPPED_EFFECTS = 4
"""First effects tried again beside a second one: the best single effect need not be in the best pair."""

FOLDED_HYPOTHESES = 6
"""Best hypotheses that are judged by runs left out in turn, where none is held out."""

LEFT_OUT_PARTS = 3
"""Parts of the measured runs that are left out in turn."""

# Floors

LAW_SHARE = 0.1
"""Part of a residual's mean square that must be predictable to call it a law: of noise less is, by chance."""

WANDERING_SPREAD_SHARE = 0.02
"""A residual that is neither a law nor white is no instrument's noise beyond this."""

WHITE_SHARE = 0.5
"""A residual is white if this part of its mean square changes from sample to sample."""

SLOW_RATIO = 6.0
"""Residual over its white part beyond which it is no instrument's noise, even if it is smaller than that."""

EXPLAINED_SHARE = 0.8
"""Part of the gap that effects must close on held-out runs, and where something lawful is left all the same."""

LEADING_SHARE = 0.5
"""The same of measured runs, for an effect that no other comes near: of laws that are none of the library's ours close
less, or several as much."""

OPEN_GAP_EFFECTS = 2
"""At most so many effects are named where something lawful is left: of three flexible laws some sum closes nearly any
gap."""

REFERENCE_RATIO = 1.3
"""A gap within this factor of that on reference runs is the form of the model, and so is what an effect removes."""

MISLEADING_RATIO = 1.1
"""Error on held-out runs over that of the refitted model beyond which the effects of an answer mislead: a law of a rig
makes it no worse."""

MISLEADING_STATE_RATIO = 1.5
"""The same of effects that have a state of each run, as wear has: of a run that was not fitted it is not known."""

GAP_FLOOR_SHARE = 0.02
"""Mean square above the floor, as a part of the floor's, from which on there is a gap to close."""

# What the runs could show

ORDINARY_SPREAD_SHARE = 0.05
"""An effect that makes this much in ordinary use would be plain; the runs show it, or do not."""

ORDINARY_HZ = 1.0
"""Highest frequency of a full stroke in ordinary use; tendon-sheath drives of robots and exosuits reach it."""

ORDINARY_TURNS = 1.5
"""Turns of a drum in ordinary use."""

ONE_SIDED_SHARE = 0.9
"""Part of its mean by which a load swings in ordinary use at most, where it has one sign in all runs: tendons pull."""

VISIBLE_DEVIANCE = 16.0
"""Evidence that such an effect must gain in the runs: twice what tells two hypotheses apart."""

CONTAINED_SHARE = 0.03
"""An effect of which less than this part is beyond the model in ordinary use is in the model already."""

# The way to a model that predicts

LOST_SHARE = 1.0
"""Part of a channel's spread beyond which a refit from default values has lost its way: a constant of each run would do
better."""

PARAMETER_GAIN = 0.02
"""Log of the mean squares, over the channels, on runs left out that each parameter of a step must gain: less is hardly
seen, and laws of many parameters fit anything."""

SURE_GAIN_RATIO = 1.5
"""So many standard errors over the runs are no gain for sure: of several candidates the best is partly lucky."""

MOST_STEPS = 8
"""Steps on the way: more is no help to a reader."""

REVISITED_STEPS = 2
"""Last steps of the way at which the second best is taken too: each is a way of its own to go."""

WAY_SAMPLES_RATIO = 4
"""The way judges on so many times the samples of the search: what a model that holds its load fits between few of them
does not hold on the others."""

BEGUN_CANDIDATES = 8
"""Candidates of a step, of those that one linear step ranks best, that a few steps of a refit probe."""

JUDGED_CANDIDATES = 4
"""Of these, so many are refitted and judged on runs left out: refits take seconds."""

ZERO_SHARE = 0.05
"""Part of the mean square left that the zeros of the runs must make up to be said."""

# Where the residual is, and formulas of it

FALSE_DISCOVERY_RATE = 0.05
"""Of the places called significant, over all coordinates and channels (Benjamini and Hochberg 1995)."""

HARMONIC_PERIODS = 4
"""Whole periods in a run below which its harmonics have no background beside them."""

NOTABLE_SHARE = 0.1
"""A coordinate must explain this part of the residual to be worth a sentence."""

FAMILY_SHARE = 0.1
"""Laws of a family must predict this part of a residual on parts left out, or nothing is said of its family."""

FAMILY_TIE_SHARE = 0.9
"""Families whose laws predict this part of what the best family's predict are not told from it: all are said."""

CONTRADICTING_SHARE = 0.6
"""Where laws of a family predict this part of a residual, and those of the families of an answer less than half of
that, the answer is none: its law bends to one of another kind."""

TONE_SHARE = 0.3
"""Part of what a model leaves that a tone makes to be one, in each half of each run: noise has next to none at one
frequency, and what rings with the motion is not in step with itself."""

TONE_MOTION_RATIO = 8.0
"""A tone is looked for above this many times the frequency of the motion, which is that of its acceleration over its
speed: below, it may be a harmonic."""

NEAR_TONE_SHARE = 0.6
"""As TONE_SHARE, of a tone nearer to the motion: most of what is left, which of a law of the motion one harmonic is
only where that is nearly a sine."""

NEAR_TONE_MOTION_RATIO = 5.0
"""As TONE_MOTION_RATIO, of such a tone: above the third harmonic, which of what friction lacks in a sine is loudest,
also where that of the motion is a little faster than its acceleration over its speed."""

TONE_WANDER_SHARE = 0.001
"""Part of its frequency by which a tone may differ from run to run: mains mostly keep to 50 mHz of 50 Hz."""

TONE_STEADY_SHARE = 0.2
"""Deviation of the speed over its mean below which it is steady: a tone may then be a law of the position."""

WANDER_FUNCTIONS = 6
"""Slow functions of time in a run, to three periods: a zero that wanders faster is hardly told from the motion."""

WANDER_SHARE = 0.5
"""Part of what a model leaves of a run that these must make, in each: of a law of a faster motion they make little."""

WANDER_MOTION_SHARE = 0.3
"""Part of the motion that they may make: a motion as slow as they are is followed by what a law of it lacks."""

LIMIT_WIDTH_SHARE = 0.25
"""Where the model is highest, or lowest, the channel moves by less than this part of what the model does and is nowhere
beyond: it stands at a limit. What a model lacks of friction bends, and does not stop."""

LIMIT_SAME_RATIO = 1.3
"""From one part of the model's highest samples to the next larger one a channel at a limit moves by less than this many
times as much, as its noise does."""

LIMIT_WIDER_RATIO = 1.1
"""The model moves there by more than this many times as much: it goes on."""

LIMIT_SPEED_SHARE = 0.05
"""A drive below this part of the RMS of its speed may rest there, and its channel with it."""

LIMIT_EXCESS_RATIO = 2.0
"""Where a channel stands at a limit the model as given, or refitted, is off by more than this many times what it is
elsewhere: it goes on there, and is a model of the rig."""

LIMIT_VISITS = 3
"""Stretches of motion in which it does so, at least: once may be chance, or a rest."""

LIMIT_STEPS = 2.0
"""Steps of a channel's converter that the model moves by meanwhile, at least: within one it stands anyway."""

LITTLE_SPREAD_SHARE = 0.003
"""Where no effect is missing a family is said of what is left if its laws predict more than this: the form of the
model, of use to who improves it."""

FORMULA_SHARE = 0.05
"""A formula must predict this part of the residual where it was not fitted; less is no help."""

FORMULA_P = 0.02
"""Probability by chance below which a formula is given; of the noise of two runs 3 % get one where it forgets within a
twentieth of a run, 9 % where it forgets only within a fifth."""

FORMULA_TERMS = 4
"""Most terms of a formula: more is no help to a reader."""

FORMULA_TERM_SHARE = 0.03
"""A longer formula must predict this part of the residual more."""

RETURNED_WORK_SHARE = 0.02
"""Friction may give back this part of the work against it: presliding stores, and sensors are late."""

# What is worth a word

CHANGED_SHARE = 0.02
"""A parameter, or an error, that a refit moved by less than this part of itself is not mentioned."""

WEIGHTY_SHARE = 0.1
"""Nor is a parameter whose move does less than this part of what another's does."""

ABOVE_FLOOR_RATIO = 1.3
"""An error from this many floors on is said to be above the floor."""

SURE_FLOOR_SHARE = 0.8
"""A floor whose lower bound is above this part of it is shown as one number."""

ELSEWHERE_RATIO = 4.0
"""Error on held-out runs over that on measured and on reference ones beyond which only their motion shows a gap: the
form of a model differs between motions too, mostly by less than three."""

ELSEWHERE_SPREAD_SHARE = 0.05
"""Part of a channel's spread that such a gap must be: the form of a model is hardly ever as much."""

FORM_RATIO = 3.0
"""Error on runs of one motion over that on runs of another beyond which it is no form of a refitted model: that leaves
hardly ever as much more of one than of another."""

CARRIED_OVER_RATIO = 2.0
"""Error on held-out runs over that on measured ones beyond which a fit does not carry over to their motion."""
