"""`report.html`: a run or an experiment on one page that needs nothing else."""
