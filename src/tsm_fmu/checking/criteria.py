"""Criteria of the check: what makes something in a log a finding, each with its unit in its name and its reason.

``*_SHARE`` is a part of what its sentence names. ``docs/checking.md`` lists them (``build_scripts/write_criteria.py``).
"""

# Clock

GAP_INTERVALS = 1.5
"""An interval longer than this many median ones is a gap: at least half a sample is missing, which no jitter does."""

JITTER_SHARE = 0.05
"""Sampling jitters where its RMS is more than this part of the interval: derivatives then err by about as much."""

MOST_GAPS_LISTED = 5
"""So many gaps are findings of their own; the others are one finding together."""

# Resolution and range of a sensor

COARSE_STEPS = 50.0
"""A sensor is coarse for a motion that holds fewer steps: a step is then more than 2 % of all that is seen."""

LIMIT_SAMPLES = 10
"""Fewest samples at the limit of a channel, or of one value, that are no coincidence."""

LIMIT_SHARE = 0.002
"""Fewest samples at a limit as a part of the run."""

NOISY_SHARE = 0.2
"""A channel is noisy where more than this part of the samples near its limit turns back at once: a value that then
repeats is clipped."""

NEAR_LIMIT_SHARE = 0.2
"""Near the limit for that question: this part of the range."""

VISIT_SHARE = 0.05
"""A visit of the limit: the signal comes this close, as a part of the range."""

VISITS_CUT_SHARE = 0.8
"""A stop or a clipped input cuts nearly all visits; friction holds a position at its limit now and then only."""

LIMIT_SPEED_SHARE = 0.35
"""Least speed, as a part of the usual one, at which a clipped signal runs into its limit; a drive that turns slows."""

# A value that does not move

STUCK_TRAVEL_SHARE = 0.3
"""A channel is stuck where it repeats one value while another position moves over more than this part of its range."""

REST_TRAVEL_SHARE = 1e-3
"""A speed of exactly zero while no position moves over more than this part of its range is a rest."""

STUCK_REPEATS = 30.0
"""A noisy channel is stuck where it repeats one value this many times longer than it usually does."""

STUCK_SHARE = 0.005
"""And for this part of the run at least."""

# Events

EVENT_TIMES_USUAL = 5.0
"""An event stands out from the local motion by this many times what is usual; noise and stick-slip, which recur, do
not."""

USUAL_QUANTILE = 0.75
"""Usual is what three of four blocks of the run do not exceed."""

EVENT_RANGE_SHARE = 0.02
"""Smaller than this part of the channel's range is no event, however quiet the channel is."""

SPIKE_RANGE_SHARE = 0.05
"""A single sample outside its neighbours by less than this part of the channel's range is left as it is: it hardly
moves a fit, and a sharp peak of friction between few samples is as large."""

EVENT_SENSOR_STEPS = 4.0
"""Nor is what is fewer steps of the sensor."""

EVENT_FOOT_SHARE = 0.15
"""An event lasts while it is above this part of its height: a wide one pulls the running median along."""

JUMP_SAMPLES = 11
"""Samples around a jump from whose increments it stands out, and over which the level before and after is taken."""

JUMP_KEPT_SHARE = 0.5
"""A jump keeps more than this part of its step; what comes back at once is a glitch."""

MOVE_SPEED_RATIO = 1.5
"""What a drive does no faster than this many times what it does elsewhere in the run is a move of it, and no event."""

MOVE_PLACES = 3
"""It must do so in this many other places: a knock may come twice."""

GLITCH_SAMPLES = 3
"""An excursion of so many samples or fewer is a glitch of the measurement: no drive moves there and back so fast."""

FEWEST_BLOCKS = 8
"""Blocks that a run must have to say what is usual in it."""

# Motion

REST_SPEED_SHARE = 0.02
"""The drive rests below this part of the speed that it reaches (its 99 % quantile)."""

TURN_SHARE = 0.02
"""A turning point stands out by this part of the range: less is wobble."""

TURN_SENSOR_STEPS = 3.0
"""And by this many steps of the sensor."""

LINE_POWER_SHARE = 0.03
"""A frequency of the motion has this part of the strongest line's power."""

SLOW_SPEED_SHARE = 0.1
"""Around a turn, below this part of the speed that the drive reaches, a force may change by its whole range."""

BREAK_AWAY_SHARE = 0.1
"""After a turn a force may change by its whole range until the drive has moved by this part of its own."""

# Coverage

FEWEST_REVERSALS = 3
"""With fewer turning points a hysteresis loop is not repeated, and noise cannot be told from a law."""

INNER_LOOP_SHARE = 0.8
"""Half strokes that are all longer than this part of the longest make no inner loops: memory is not seen."""

LOAD_VARIATION_SHARE = 0.5
"""A load that varies by less than this part of its size does not show load dependence."""

LONG_REST_S = 2.0
"""Creep, and break-away that grows with rest, need a rest of this length [s]."""

# Signs

POWER_SHARE = 0.05
"""A drive seems to take power out where the work is below minus this part of what it would be all one way."""

OPPOSITE_POSITIONS = -0.5
"""Output and input position that correlate by less have opposite senses; backlash and friction never do that."""

OPPOSITE_EFFORTS = -0.7
"""Output and input torque that correlate by less have opposite senses; friction and inertia may set them against each
other that far."""
