"""Designs side by side: where they differ, what is gained, what it costs."""
