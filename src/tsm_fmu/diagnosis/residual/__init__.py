"""Where the residual is, on what it depends, and a formula for it."""
