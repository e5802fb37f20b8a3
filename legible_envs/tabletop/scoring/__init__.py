"""The legibility score of tables: kernels, their tables, the scorer, and explanations of a score."""
