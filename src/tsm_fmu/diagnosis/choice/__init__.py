"""Which hypothesis the runs support, down to which floor, and what they could not show."""
