"""One model over the life of a drive: which of its parameters move from run to run, how, and what would not be seen."""
