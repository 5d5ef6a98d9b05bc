"""What the environment must say before Zenoh's threads start in a process; light, for whoever starts it.

A link's socket belongs to the threads that have opened it, those that accept (``acc``) or those that connect
(``net``): left to themselves, each message wakes one of them, to wake the one that reads (``rx``).
"""

_OPENED_BY_READER = "rx: (worker_threads: 1), net: (handover: rx), acc: (handover: rx)"

ROUTER_RUNTIME = {"ZENOH_RUNTIME": f"({_OPENED_BY_READER})"}
"""One thread is enough to receive, and saves CPU; it passes on what it hears, and another one sends."""
NODE_RUNTIME = {"ZENOH_RUNTIME": f"({_OPENED_BY_READER}, tx: (handover: rx))"}
"""The thread that receives also sends: an answer is on its way without another one being woken. Not so in a
router, which would wait for itself where somebody outside is too slow for what it passes on.
"""
