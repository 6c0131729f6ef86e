"""Rigid machines in motion: rates of joints and drives, what moves them, and the equations in operator form."""
