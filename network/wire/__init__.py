"""What is said: messages, their bytes, and under which keys."""
