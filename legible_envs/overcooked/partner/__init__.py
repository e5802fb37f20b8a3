"""A second player who shares the kitchen with a person: a robot that predicts them, other players, and the team."""
