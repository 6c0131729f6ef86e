"""A machine as a scene: solids with places, materials and names, for a page, a report or a CAD file to show."""
