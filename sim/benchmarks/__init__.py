"""What filter and network cost on this machine, as ratios within one run: the code behind `dcpf bench`."""
