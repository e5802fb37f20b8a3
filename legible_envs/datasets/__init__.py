"""Real people: recorded kitchens (Overcooked-AI, 2019) and pointing movements, read into trajectories."""
