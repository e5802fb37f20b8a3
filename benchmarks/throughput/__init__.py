"""``legible bench``: how fast everything is, as ratios within one run. See :mod:`benchmarks.throughput.sweep`."""
