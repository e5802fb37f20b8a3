"""The legibility score of kitchens: kernels, their tables, and explanations of a score."""
