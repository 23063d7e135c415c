"""The passes that a frame is drawn with."""
