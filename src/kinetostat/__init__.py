"""kinetostat: how stiff a parallel kinematic machine is, where it is weak, why, and how to make it better."""
