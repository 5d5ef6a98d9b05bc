"""How nodes talk: graphs, consensus, messages, and Zenoh; nothing of particles or of what pixels mean."""
