"""The live page: a run as it happens, in a browser. It listens over Zenoh as anybody could."""
