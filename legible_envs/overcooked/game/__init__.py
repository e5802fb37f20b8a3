"""The running game of the kitchen: state vectors, rules, goals, observations, replay."""
