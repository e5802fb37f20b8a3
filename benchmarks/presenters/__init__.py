"""How the layouts of each workspace are named, printed, drawn and put into a report."""
