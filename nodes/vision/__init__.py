"""What a camera sees of the target: colours, histograms, distances, likelihoods."""
