"""Water techniques: one file each, parameters and behaviour together."""
