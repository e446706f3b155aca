"""Jia et al., Adv. Mech. Eng. 2020: LeBus winding and transmission."""
