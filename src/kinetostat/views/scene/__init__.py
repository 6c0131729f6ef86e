"""A machine as a scene: solids with places, materials and names, which pages, reports and CAD files show."""
