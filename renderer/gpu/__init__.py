"""The only room that speaks OpenGL."""
