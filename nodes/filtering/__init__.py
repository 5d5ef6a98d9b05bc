"""The mathematics of the filters: arrays in, arrays out, randomness passed in."""
