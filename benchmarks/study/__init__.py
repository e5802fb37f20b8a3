"""`legible study`: studies with participants in the browser, whose data go through the experiments' own analysis."""
