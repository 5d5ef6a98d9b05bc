"""Replays: a recorded run told again over Zenoh, under the keys that it had."""
