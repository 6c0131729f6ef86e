"""Joints, links, legs, the machine: frozen data, one file per family in `catalogue`."""
