"""The regression kit under identification and diagnosis: problem, search, sensitivities, uncertainty."""
