"""Predictors of walks between stations of a kitchen."""
