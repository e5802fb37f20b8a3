"""Predictors for reaches over a table: positions instead of cells."""
