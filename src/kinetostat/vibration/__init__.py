"""How machines vibrate about a state: masses, modes, and the motion of the tool that a varying force makes."""
