"""Millpond's renderer: reflective and refractive water, drawn without a display."""
