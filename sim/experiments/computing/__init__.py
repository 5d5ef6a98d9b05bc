"""What an experiment computes, where, and where it is kept."""
