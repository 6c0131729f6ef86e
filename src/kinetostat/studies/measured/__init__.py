"""A measured stiffness beside the computed one, with the uncertainties of both."""
