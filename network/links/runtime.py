"""What a node's environment must say before its process starts; light, for whoever starts it."""

RUNTIME_ENVIRONMENT = {"ZENOH_RUNTIME": "(rx: (worker_threads: 1))"}
"""One thread is enough to receive, and saves CPU."""
