"""Recordings of runs: MCAP files that Rerun and Foxglove open, and that play again over Zenoh."""
