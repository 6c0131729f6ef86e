"""The linked views of the page: each shows one side of an analysis. No formula here."""
