"""Where frames are drawn: engines behind one seam, ``concurrent.futures.Future``."""
