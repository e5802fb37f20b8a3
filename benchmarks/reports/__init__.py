"""Pages that are written: of a search, of predictors on trajectories, of an experiment."""
