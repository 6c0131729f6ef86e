"""The same machine in an engine that is not ours: built from its geometry, loaded, and compared with our C."""
