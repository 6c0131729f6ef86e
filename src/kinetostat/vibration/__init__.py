"""Vibration about a state: masses, modes, and the motion of the tool under a varying force."""
