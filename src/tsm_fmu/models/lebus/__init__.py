"""What the three LeBus models share: geometry, rig, state, one step of the whole loop."""
