"""Averaging algorithms: how a node's value moves towards the network's average in one round."""
