"""Emitters propose the next layouts. The contract for your own is in :mod:`optimizers.emitters.registry`."""
