"""The Ask tab of the studio: every question of `views.questions`, its form, and its answer."""
