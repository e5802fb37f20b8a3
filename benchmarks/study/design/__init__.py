"""A study as a folder: settings, texts, layouts and questionnaires, checked as a whole."""
