"""The pages of a study in the browser."""


def sprites(domain: str) -> str:
    """X."""
    return "<svg/>"
