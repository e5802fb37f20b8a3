"""``legible bench``: how fast things are, as ratios within one run. See :mod:`benchmarks.throughput.sweep`."""
