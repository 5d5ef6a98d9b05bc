"""What carries messages: Zenoh, memory, and links that are bad on purpose."""
