"""Zenoh's own threads, and the interpreter's state in them."""

import ctypes
import threading

_here = threading.local()


def keep_state() -> None:
    """Keeps the interpreter's state of the calling thread, which Python has not started, for good.

    Without it, every call from Zenoh into Python makes such a state, with 16 KB of stack that are mapped and
    unmapped, and destroys it at its end.
    """
    if not hasattr(_here, "kept"):
        _here.kept = True
        ctypes.pythonapi.PyGILState_Ensure()
