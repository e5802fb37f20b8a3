"""Predictors for trajectories between the stations of a kitchen."""
