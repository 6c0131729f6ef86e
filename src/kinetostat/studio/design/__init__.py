"""The design tab of the studio: studies, searches in other processes, their results, favourites. No formulas."""
