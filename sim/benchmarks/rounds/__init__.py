"""What a round of consensus costs among processes: the code behind `dcpf bench consensus`."""
