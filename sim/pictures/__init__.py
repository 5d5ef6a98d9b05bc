"""Pictures of a run: annotated camera pictures, the ground from above, clips, and figures on paper."""
