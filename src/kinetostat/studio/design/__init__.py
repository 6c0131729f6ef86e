"""The studio's design tab: studies, searches in processes of their own, their results, favourites. No formula here."""
