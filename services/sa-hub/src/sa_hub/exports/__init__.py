"""Histories for other programs: GPX, KML, GeoJSON, CSV, and MCAP with what Foxglove's map understands."""
