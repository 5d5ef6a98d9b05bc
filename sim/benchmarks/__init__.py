"""What the filter costs on this machine, as ratios within one run: the code behind `dcpf bench`."""
