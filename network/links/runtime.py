"""What the environment must say before Zenoh's threads start in a process; light, for whoever starts it."""

ROUTER_RUNTIME = {"ZENOH_RUNTIME": "(rx: (worker_threads: 1))"}
"""One thread is enough to receive, and saves CPU; it passes on what it hears, and another one sends."""
NODE_RUNTIME = {"ZENOH_RUNTIME": "(rx: (worker_threads: 1), tx: (handover: rx))"}
"""The thread that receives also sends: an answer is on its way without another one being woken. Not so in a
router, which would wait for itself where somebody outside is too slow for what it passes on.
"""
