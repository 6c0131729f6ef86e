"""A report for a design review: what it says as plain data, and that data as one HTML page or one PDF."""
