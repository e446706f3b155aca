"""Laws that several models share: friction, hysteresis, filters."""
