"""The HTTP routes: thin, one call each into the rooms below."""
