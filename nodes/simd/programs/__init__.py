"""The programs of the tracker, written in the array's primitives alone."""
