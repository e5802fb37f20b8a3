"""Exports of a study, and its tables, figures and report."""
