"""What a person can put right about where an experiment is computed."""


class EngineError(Exception):
    """The engine cannot be used; the text says why and what to do."""
