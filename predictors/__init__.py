"""Predictors of a person's next goal, and how well they read recorded or simulated people."""
