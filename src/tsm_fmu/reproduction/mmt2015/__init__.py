"""Do et al., Mech. Mach. Theory 85 (2015): modified LuGre friction."""
