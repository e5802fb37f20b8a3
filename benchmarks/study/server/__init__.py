"""The server of a study: participants join, play and answer; researchers watch."""
