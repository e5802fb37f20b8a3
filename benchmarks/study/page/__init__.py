"""The pages of a study in the browser."""
