"""Who talks to whom: graphs, and what their spectra tell."""
