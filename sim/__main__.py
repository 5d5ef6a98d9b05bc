"""`python -m sim` is the `dcpf` command."""

from sim.commands import main

main()
