"""The folder of a search: what is written, checkpoints, and reading it back."""
