"""Reports for design reviews: their content as plain data, and that data as one HTML page or one PDF."""
