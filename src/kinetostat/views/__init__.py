"""Answers as people see them: tables, figures, pages. Computes nothing."""
