"""A model, or a model with effects, as one object that runs plain or compiled."""
