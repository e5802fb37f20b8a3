"""The aisle of a warehouse: a workspace for legible-envs in a package of its own (see README.md)."""
