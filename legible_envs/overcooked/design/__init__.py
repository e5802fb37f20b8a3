"""The design of kitchens: the workspace with its rules, genomes and how they vary."""
