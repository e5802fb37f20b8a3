"""Recordings of real people: kitchens (Overcooked-AI, 2019) and pointing movements, as trajectories."""
