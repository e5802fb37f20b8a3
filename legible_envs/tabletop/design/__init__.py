"""The design of tables: the workspace with its rules, genomes, validity and measures."""
