"""The field's figures, as pure mathematics: sets, consistency, loss, bounds, intervals."""
