"""The two ways in which networking goes wrong: our side's fault, or a peer's."""


class NetworkError(Exception):
    """Our side cannot use the network: a port is taken, a router does not answer.

    The message is one sentence that names the endpoint and says what to do.
    """


class RefusedMessage(Exception):  # noqa: N818 - it is a verdict on a peer's bytes, not an error of ours
    """A peer's bytes are not a message that may be used here.

    Whoever receives counts it by reason and goes on without it.

    Attributes:
        reason: A short slug to count by, such as ``"length"``, ``"version"``, ``"run"`` or ``"not-finite"``.
    """

    def __init__(self, reason: str) -> None:
        super().__init__(f"message refused: {reason}")
        self.reason = reason
