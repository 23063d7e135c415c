"""The world round the water, described without a GPU."""
