"""Shortest paths of the hand among virtual obstacles, and points in motion along them."""
