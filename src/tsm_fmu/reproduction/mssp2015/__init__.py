"""Do et al., Mech. Syst. Signal Process. 60-61 (2015): backlash-like hysteresis of paired tendons."""
