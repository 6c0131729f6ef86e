"""Machines at rest under their loads, with exact geometry: states, tangent stiffness and commands."""
