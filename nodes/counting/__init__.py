"""How often each colour occurs in each of many boxes: several ways to count, equal to the last one."""
